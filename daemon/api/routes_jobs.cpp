#include <nlohmann/json.hpp>

#include "daemon/api/downloads.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

const RequestField kFile{.name = "file",
                         .description = "path within the job's folder, its slashes written %2F",
                         .required = true,
                         .min = 1,
                         .max = 512};
constexpr std::int64_t kPage = 50, kMaxPerPage = 500;

/// Newest first; `before` is the last one of the page before.
void list(const ApiStation& station, const Values& values, const Send& send) {
  const auto snapshot = station.loop.snapshot();
  const auto& jobs = snapshot->jobs;
  const auto state = values.text("state");
  const auto limit = static_cast<std::size_t>(values.integer("limit").value_or(kPage));
  auto at = values.has("before") ? jobs.lower_bound(*values.text("before")) : jobs.end();
  ordered_json page = ordered_json::array();
  while (at != jobs.begin() && page.size() < limit) {
    --at;
    if (!state || *state == to_string(at->second->state)) page.push_back(to_json(*at->second));
  }
  const bool more = at != jobs.begin() && !page.empty();
  const auto next = more ? page.back()["id"] : ordered_json(nullptr);
  send({.body = to_text({{"jobs", std::move(page)}, {"next", next}})});
}

void show(const ApiStation& station, const Values& values, const Send& send) {
  const auto job = find_job(station, values);
  send(job ? ApiResponse{.body = to_text(to_detailed_json(*job))} : no_such_job());
}

void files(const ApiStation& station, const Values& values, const Send& send) {
  const auto job = find_job(station, values);
  if (!job) return send(no_such_job());
  const auto found = list_files(job->folder);
  if (!found) return send(error_response(found.error()));
  ordered_json all = ordered_json::array();
  for (const auto& file : *found) {
    all.push_back({{"path", file.path}, {"bytes", file.bytes}, {"type", media_type(file.path)}});
  }
  send({.body = to_text({{"files", std::move(all)}})});
}

void send_file(const ApiStation& station, const Values& values, const std::string& path, const Send& send) {
  const auto job = find_job(station, values);
  if (!job) return send(no_such_job());
  const auto file = open_below(job->folder, path);
  if (!file) return send(error_response(file.error()));
  send({.body = *file, .type = media_type(path)});
}

Route suggestion_route() {
  return {.method = Method::get,
          .path = "/api/v1/jobs/{id}/suggestions/{number}",
          .role = Role::viewer,
          .description = "How a job's part can lie in the next pose, as seen from between the cameras. Orange: unseen.",
          .in_path = {kJobId,
                      {.name = "number",
                       .type = RequestField::Type::integer,
                       .description = "of the suggestion",
                       .required = true,
                       .min = 1,
                       .max = 9}},
          .reply = {.description = "an image", .type = "image/png"},
          .errors = {500},
          .slow = true,
          .handle = [](const ApiStation& station, const Values& values, const Send& send) {
            const auto name = rest_image(static_cast<int>(*values.integer("number")));
            send_file(station, values, "live/" + name, send);
          }};
}

Route list_route() {
  return {.method = Method::get,
          .path = "/api/v1/jobs",
          .role = Role::viewer,
          .description = "All jobs, newest first, a page at a time.",
          .in_query = {{.name = "limit",
                        .type = RequestField::Type::integer,
                        .description = "jobs per page, 50 without it",
                        .min = 1,
                        .max = kMaxPerPage},
                       {.name = "before", .description = "`next` of the page before", .min = 1, .max = 128},
                       {.name = "state",
                        .description = "only these",
                        .words = {"queued", "scanning", "waiting_for_flip", "reconstructing", "done", "failed",
                                  "interrupted", "cancelled"}}},
          .reply = {.description = "a page", .schema = "JobPage"},
          .handle = list};
}

}  // namespace

std::vector<Route> job_routes() {
  return {
      list_route(),
      {.method = Method::get,
       .path = "/api/v1/jobs/{id}",
       .role = Role::viewer,
       .description = "One job with its views and stages.",
       .in_path = {kJobId},
       .reply = {.description = "the job", .schema = "JobDetail"},
       .handle = show},
      suggestion_route(),
      {.method = Method::get,
       .path = "/api/v1/jobs/{id}/files",
       .role = Role::viewer,
       .description = "The files in a job's folder: images, manifest, model, report.",
       .in_path = {kJobId},
       .reply = {.description = "as they are now", .schema = "FileList"},
       .errors = {500},
       .slow = true,
       .handle = files},
      {.method = Method::get,
       .path = "/api/v1/jobs/{id}/files/{file}",
       .role = Role::viewer,
       .description = "One file of a job, such as pose1%2Fview00%2Fleft_pattern.png.",
       .in_path = {kJobId, kFile},
       .reply = {.description = "the file, with the media type of its ending", .type = "application/octet-stream"},
       .errors = {500},
       .slow = true,
       .handle = [](const ApiStation& station, const Values& values,
                    const Send& send) { send_file(station, values, *values.text("file"), send); }},
      {.method = Method::get,
       .path = "/api/v1/jobs/{id}/model",
       .role = Role::viewer,
       .description = "The textured model of a job.",
       .in_path = {kJobId},
       .reply = {.description = "glTF 2.0, binary", .type = "model/gltf-binary"},
       .errors = {500},
       .slow = true,
       .handle = [](const ApiStation& station, const Values& values,
                    const Send& send) { send_file(station, values, "model/model.glb", send); }},
      {.method = Method::get,
       .path = "/api/v1/jobs/{id}/report",
       .role = Role::viewer,
       .description = "The report of a job's reconstruction.",
       .in_path = {kJobId},
       .reply = {.description = "report.json as it was written", .schema = "Report"},
       .errors = {500},
       .slow = true,
       .handle = [](const ApiStation& station, const Values& values,
                    const Send& send) { send_file(station, values, "model/report.json", send); }},
  };
}

}  // namespace scanrig
