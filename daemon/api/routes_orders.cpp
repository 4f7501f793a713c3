#include <nlohmann/json.hpp>

#include "daemon/api/downloads.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig {
namespace {

using What = event::JobRequested::What;
using Type = RequestField::Type;

ControlLoop::Reply reply_with(std::string job, Send send) {
  return [job = std::move(job), send = std::move(send)](const Result<std::string>& done) {
    if (!done) return send(error_response(done.error()));
    send({.body = to_text({{"job", job.empty() ? *done : job}})});
  };
}

void order(const ApiStation& station, const Values& values, Send send) {
  station.loop.order({.recipe = values.text("recipe").value_or("default"),
                      .part = values.text("part").value_or(""),
                      .repeat = static_cast<int>(values.integer("repeat").value_or(1))},
                     reply_with("", std::move(send)));
}

void ask(const ApiStation& station, const Values& values, What what, Send send) {
  const auto id = *values.text("id");
  if (!find_job(station, values)) return send(no_such_job());
  station.loop.ask(event::JobRequested{.what = what,
                                       .job = id,
                                       .voxel_mm = values.number("voxel_mm"),
                                       .fusion = values.text("fusion").value_or(""),
                                       .number = static_cast<int>(values.integer("number").value_or(0))},
                   reply_with(id, std::move(send)));
}

Route job_route(Method method, std::string_view path, Role role, What what, std::string_view description,
                std::vector<RequestField> body = {}) {
  return {.method = method,
          .path = path,
          .role = role,
          .description = description,
          .in_path = {kJobId},
          .in_body = std::move(body),
          .reply = kJobDone,
          .errors = {409, 500},
          .handle = [what](const ApiStation& station, const Values& values, Send send) {
            ask(station, values, what, std::move(send));
          }};
}

Route order_route() {
  return {
      .method = Method::post,
      .path = "/api/v1/jobs",
      .role = Role::operating,
      .description = "Queues scans. The reply comes when their folders are durable, and has the id of the first one.",
      .in_body =
          {{.name = "recipe", .description = "one of the configuration's; default without it", .min = 1, .max = 64},
           {.name = "part", .description = "of what is scanned: barcode or free text", .min = 0, .max = 200},
           {.name = "repeat",
            .type = Type::integer,
            .description = "so many jobs; 1 without it",
            .min = 1,
            .max = 100}},
      .reply = kJobDone,
      .errors = {404, 409, 500},
      .handle = order};
}

Route recipes_route() {
  return {.method = Method::get,
          .path = "/api/v1/recipes",
          .role = Role::viewer,
          .description = "The recipes of the configuration; Start scans `default` when nothing is queued.",
          .reply = {.description = "by name", .schema = "Recipes"},
          .handle = [](const ApiStation& station, const Values&, const Send& send) {
            auto recipes = nlohmann::ordered_json::array();
            for (const auto& [name, recipe] : station.loop.rules().recipes) {
              recipes.push_back({{"name", name}, {"poses", recipe.poses}, {"views", recipe.views}});
            }
            send({.body = to_text({{"recipes", std::move(recipes)}})});
          }};
}

Route bundle_route() {
  return {
      .method = Method::get,
      .path = "/api/v1/jobs/{id}/bundle",
      .role = Role::operating,
      .description =
          "The whole folder of a job that has ended, as one archive to send to support. The job counts as exported.",
      .in_path = {kJobId},
      .reply = {.description = "a compressed tar archive", .type = "application/gzip"},
      .errors = {409, 500},
      .once = true,
      .reply_timeout = std::chrono::seconds(180),
      .handle = send_bundle};
}

}  // namespace

std::vector<Route> order_routes() {
  return {
      recipes_route(),
      order_route(),
      job_route(Method::post, "/api/v1/jobs/{id}/cancel", Role::operating, What::cancel,
                "Ends a job that is queued, interrupted or being reconstructed."),
      job_route(Method::post, "/api/v1/jobs/{id}/resume", Role::operating, What::resume,
                "The next Start continues this interrupted job."),
      job_route(Method::post, "/api/v1/jobs/{id}/first", Role::operating, What::to_front,
                "The next Start starts this queued job."),
      job_route(Method::post, "/api/v1/jobs/{id}/choose", Role::operating, What::choose,
                "Of the ways in which pose 2 fits, that give different surfaces, this one is right: the model is made.",
                {{.name = "number",
                  .type = Type::integer,
                  .description = "as the job's choices are numbered",
                  .required = true,
                  .min = 1,
                  .max = 1000}}),
      job_route(Method::post, "/api/v1/jobs/{id}/add-pose", Role::operating, What::add_pose,
                "A finished scan gets another pose: the next Start scans it. Cancelled before it is whole, the scan is "
                "as it was."),
      job_route(Method::post, "/api/v1/jobs/{id}/exported", Role::operating, What::set_exported,
                "Marks the job exported; retention may delete it."),
      job_route(Method::post, "/api/v1/jobs/{id}/reprocess", Role::engineer, What::reprocess,
                "Makes the model again, from the images.",
                {{.name = "voxel_mm",
                  .type = Type::number,
                  .description = "as configured without it",
                  .min = kMinVoxelMm,
                  .max = kMaxVoxelMm},
                 {.name = "fusion", .description = "as configured without it", .words = {"evidence", "paper"}}}),
      job_route(Method::del, "/api/v1/jobs/{id}", Role::engineer, What::remove,
                "Deletes a job that has ended, with all its files."),
      bundle_route(),
  };
}

}  // namespace scanrig
