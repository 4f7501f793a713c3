#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/api/json_replies.h"
#include "daemon/api/route.h"
#include "daemon/station/operator_message.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;
using What = event::JobRequested::What;

/// The calibration that is active, else the newest.
std::shared_ptr<const JobInfo> current_calibration(const Snapshot& snapshot) {
  const auto active = snapshot.jobs.find(snapshot.job);
  if (active != snapshot.jobs.end() && active->second->recipe.is_calibration()) return active->second;
  const auto newest = std::find_if(snapshot.jobs.rbegin(), snapshot.jobs.rend(),
                                   [](const auto& known) { return known.second->recipe.is_calibration(); });
  return newest == snapshot.jobs.rend() ? nullptr : newest->second;
}

ordered_json to_json(const std::vector<Eigen::Vector2d>& outline) {
  auto points = ordered_json::array();
  for (const auto& point : outline) points.push_back({point.x(), point.y()});
  return points;
}

ordered_json to_json(const BoardInImage& image) {
  return {{"seen", image.is_seen},
          {"problem", image.problem.empty() ? ordered_json(nullptr) : ordered_json(image.problem)},
          {"outline", to_json(image.outline)},
          {"expected", to_json(image.expected)}};
}

ordered_json number_or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json to_json(const Result<PlacementView>& view) {
  if (!view) return nullptr;  // no image yet, or no camera: the status names it
  return {{"sentence", describe(*view)},
          {"accepted", view->is_accepted()},
          {"off_deg", number_or_null(view->off_deg)},
          {"off_mm", number_or_null(view->off_mm)},
          {"left", to_json(view->left)},
          {"right", to_json(view->right)}};
}

ordered_json to_json(const Placement& placement) {
  std::string sets = placement.in_a ? "A" : "";
  if (placement.in_b) sets += "B";
  return {{"number", placement.number},     {"sets", sets},
          {"portrait", placement.portrait}, {"tilt_deg", placement.tilt_deg},
          {"front_mm", placement.front_mm}, {"on_block", placement.on_block},
          {"mark_deg", placement.mark_deg}, {"instruction", how_to_place(placement)}};
}

ordered_json views_json(const JobInfo& job) {
  auto views = ordered_json::array();
  for (const auto& view : job.stored) {
    views.push_back({{"placement", view.pose + 1},
                     {"view", view.view + 1},
                     {"table_deg", view.measured_deg},
                     {"examined", view.problems.has_value()},
                     {"problems", view.problems.value_or(std::vector<std::string>{})}});
  }
  return views;
}

ordered_json job_json(const JobInfo& job) {
  auto plan = ordered_json::array();
  for (int pose = 0; pose < job.recipe.poses; ++pose) plan.push_back(to_json(job.recipe.placement(pose)));
  const auto words = describe(job);
  const auto& outcome = job.calibration;
  return {{"id", job.id},
          {"state", to_string(job.state)},
          {"sentence", words.sentence},
          {"next_action", words.next_action},
          {"placements_complete", job.complete},
          {"plan", std::move(plan)},
          {"views", views_json(job)},
          {"verdict", outcome && !outcome->verdict.empty() ? ordered_json(outcome->verdict) : ordered_json(nullptr)},
          {"grade", outcome ? ordered_json(outcome->grade) : ordered_json(nullptr)},
          {"sentences", outcome ? outcome->sentences : std::vector<std::string>{}},
          {"accepted", outcome && outcome->is_accepted}};
}

void look(const ApiStation& station, const Values&, const Send& send) {
  const auto snapshot = station.loop.snapshot();
  const auto job = current_calibration(*snapshot);
  const auto& awaited = snapshot->awaited_placement;
  const auto& reminder = snapshot->calibration_reminder;
  send({.body = to_text({{"job", job ? job_json(*job) : ordered_json(nullptr)},
                         {"reminder", reminder.empty() ? ordered_json(nullptr) : ordered_json(reminder)},
                         {"awaited_placement", awaited ? ordered_json(awaited->placement + 1) : ordered_json(nullptr)},
                         {"board", awaited ? to_json(station.look_at_board(*awaited)) : ordered_json(nullptr)}})});
}

ControlLoop::Reply reply_with(Send send) {
  return [send = std::move(send)](const Result<std::string>& job) {
    send(job ? ApiResponse{.body = to_text({{"job", *job}})} : error_response(job.error()));
  };
}

void begin(const ApiStation& station, const Values&, Send send) {
  station.loop.order({.kind = RecipeKind::calibration}, reply_with(std::move(send)));
}

void check(const ApiStation& station, const Values&, Send send) {
  station.loop.order({.kind = RecipeKind::check}, reply_with(std::move(send)));
}

ApiResponse no_calibration() { return error_response({ErrorCode::not_found, "there is no calibration"}); }

void accept(const ApiStation& station, const Values&, Send send) {
  const auto job = current_calibration(*station.loop.snapshot());
  if (!job) return send(no_calibration());
  station.loop.ask(event::JobRequested{.what = What::accept, .job = job->id}, reply_with(std::move(send)));
}

/// An active one is stopped first, as by Stop: then it is interrupted, and can be cancelled.
void abort(const ApiStation& station, const Values& values, Send send) {
  const auto snapshot = station.loop.snapshot();
  const auto job = current_calibration(*snapshot);
  if (!job) return send(no_calibration());
  const auto cancel = [&loop = station.loop, id = job->id, send = std::move(send)](const Result<std::string>& stopped) {
    if (!stopped) return send(error_response(stopped.error()));
    loop.ask(event::JobRequested{.what = What::cancel, .job = id}, reply_with(send));
  };
  if (snapshot->job != job->id) return cancel(std::string());
  station.loop.press(Button::stop, Origin::remote, cancel, {}, values.sender());
}

Route engineers(std::string_view path, std::string_view description,
                void (*handle)(const ApiStation&, const Values&, Send), std::vector<unsigned> errors) {
  return {.method = Method::post,
          .path = path,
          .role = Role::engineer,
          .description = description,
          .reply = kJobDone,
          .errors = std::move(errors),
          .handle = handle};
}

}  // namespace

std::vector<Route> calibration_routes() {
  return {{.method = Method::get,
           .path = "/api/v1/calibration",
           .role = Role::viewer,
           .description = "The current calibration, or the last one. While a placement is awaited also how the board "
                          "stands, from the preview: at most twice a second anew.",
           .reply = {.description = "plan, views, result; the board as both cameras see it", .schema = "Calibration"},
           .slow = true,
           .handle = look},
          engineers("/api/v1/calibration/begin",
                    "Queues a calibration before all other jobs. The status says where the board goes; each Start "
                    "takes one placement.",
                    begin, {400, 409, 500}),
          engineers("/api/v1/calibration/check",
                    "Queues a check of the rig's calibration before all other jobs: the board in placement 1, six "
                    "views, one minute.",
                    check, {400, 409, 500}),
          engineers("/api/v1/calibration/accept",
                    "The calibration that was solved last becomes the rig's, or the poses that a check found; the old "
                    "file is kept beside it.",
                    accept, {404, 409, 500}),
          engineers("/api/v1/calibration/abort",
                    "Cancels the current calibration; an active one is stopped first. The rig's calibration stays.",
                    abort, {404, 409, 500})};
}

}  // namespace scanrig
