#include <atomic>
#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"
#include "pipeline/deviation/model_deviation.h"
#include "pipeline/deviation/references.h"
#include "pipeline/reconstruct/model_ruler.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr std::chrono::seconds kComparing{300};  // the processor may be busy with scans
constexpr int kMaxComparisons = 4;               // that wait or run

ordered_json to_json(const RulerEnd& end) {
  return {{"point", {end.point.x(), end.point.y(), end.point.z()}},
          {"measured", end.is_measured},
          {"sigma_mm", end.is_measured ? ordered_json(end.sigma_mm) : ordered_json(nullptr)}};
}

void measure(ModelRuler& ruler, const ApiStation& station, const Values& values, const Send& send) {
  const auto job = find_job(station, values);
  if (!job) return send(no_such_job());
  const auto point = [&](const char* x, const char* y, const char* z) {
    return Eigen::Vector3d(*values.number(x), *values.number(y), *values.number(z));
  };
  const auto length = ruler.measure(job->folder, point("from_x", "from_y", "from_z"), point("to_x", "to_y", "to_z"));
  if (!length) return send(error_response(length.error()));
  const auto& uncertainty = length->expanded_uncertainty_mm;
  send({.body = to_text({{"mm", length->mm},
                         {"expanded_uncertainty_mm", uncertainty ? ordered_json(*uncertainty) : ordered_json(nullptr)},
                         {"from", to_json(length->from)},
                         {"to", to_json(length->to)}})});
}

Route measure_route() {
  constexpr double kFarMm = 1e5;
  Route route{
      .method = Method::post,
      .path = "/api/v1/jobs/{id}/measure",
      .role = Role::viewer,
      .description =
          "The distance of two points of a job's model, with U (k = 2). Both in mm in the model's frame, "
          "within 2 mm of its surface.",
      .in_path = {kJobId},
      .reply = {.description = "the points on the surface and their distance", .schema = "Length"},
      .errors = {500},
      .slow = true,
      .handle = [ruler = std::make_shared<ModelRuler>()](const ApiStation& station, const Values& values,
                                                         const Send& send) { measure(*ruler, station, values, send); }};
  for (const char* name : {"from_x", "from_y", "from_z", "to_x", "to_y", "to_z"}) {
    route.in_body.push_back({.name = name,
                             .type = RequestField::Type::number,
                             .description = "mm",
                             .required = true,
                             .min = -kFarMm,
                             .max = kFarMm});
  }
  return route;
}

void references(const ApiStation& station, const Values&, const Send& send) {
  const auto found = list_references(station.storage);
  if (!found) return send(error_response(found.error()));
  auto all = ordered_json::array();
  for (const auto& one : *found) all.push_back({{"name", one.name}, {"bytes", one.bytes}});
  send({.body = to_text({{"references", std::move(all)}})});
}

ApiResponse deviation_response(const std::string& reference, const ModelDeviation& found) {
  return {.body = to_text({{"reference", reference},
                           {"model_file", found.model_file},
                           {"values_file", found.values_file},
                           {"vertices", found.vertices},
                           {"confirmed", found.confirmed},
                           {"fits_otherwise", found.fits_otherwise},
                           {"known_share", found.known_share},
                           {"mean_mm", found.mean_mm},
                           {"rms_mm", found.rms_mm},
                           {"p95_mm", found.p95_mm},
                           {"min_mm", found.min_mm},
                           {"max_mm", found.max_mm}})};
}

/// What was compared before is sent at once; else it is computed beside everything else, one after the other.
void deviation(const std::shared_ptr<std::atomic<int>>& waiting, const ApiStation& station, const Values& values,
               Send send) {
  const auto job = find_job(station, values);
  if (!job) return send(no_such_job());
  DeviationTask task{job->folder, station.storage, *values.text("reference")};
  const auto before = find_deviation(task);
  if (!before) return send(error_response(before.error()));
  if (*before) return send(deviation_response(task.reference, **before));
  if (++*waiting > kMaxComparisons) {
    --*waiting;
    return send(error_response({ErrorCode::busy, "other models are being compared: try again in a minute"}));
  }
  station.on_background([task = std::move(task), send = std::move(send), waiting](const std::stop_token& stop) {
    const auto made = compute_deviation(task, {stop, {}});
    --*waiting;
    send(made ? deviation_response(task.reference, *made) : error_response(made.error()));
  });
}

Route deviation_route() {
  return {.method = Method::get,
          .path = "/api/v1/jobs/{id}/deviation",
          .role = Role::viewer,
          .description =
              "How a job's model deviates from a reference. The first time it is computed, for seconds; the files that "
              "it names never change.",
          .in_path = {kJobId},
          .in_query = {{.name = "reference", .description = "its name", .required = true, .min = 1, .max = 64}},
          .reply = {.description = "figures, and the file of each vertex's deviation", .schema = "Deviation"},
          .errors = {409, 500},
          .slow = true,
          .reply_timeout = kComparing,
          .handle = [waiting = std::make_shared<std::atomic<int>>(0)](const ApiStation& station, const Values& values,
                                                                      Send send) {
            deviation(waiting, station, values, std::move(send));
          }};
}

}  // namespace

std::vector<Route> model_routes() {
  return {measure_route(),
          deviation_route(),
          {.method = Method::get,
           .path = "/api/v1/references",
           .role = Role::viewer,
           .description = "The meshes that models can be compared with, as scanrig reference added them.",
           .reply = {.description = "by name", .schema = "References"},
           .errors = {500},
           .slow = true,
           .handle = references}};
}

}  // namespace scanrig
