#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "pipeline/pose/place_poses.h"
#include "pipeline/range/thinned_view.h"
#include "pipeline/reconstruct/reconstruction_state.h"
#include "pipeline/reconstruct/report.h"

namespace scanrig {
namespace {

/// Share of two poses' surface that either looked through; a scan with less is not looked at.
constexpr double kMinSeenEmpty = 0.01;

bool any_fixture(std::span<const std::optional<Fixture>> fixtures) {
  return std::ranges::any_of(fixtures, [](const auto& fixture) { return fixture.has_value(); });
}

/// Failures of a search that a fixture explains: it contradicts, or leaves motions that fit as badly.
bool fixture_may_explain(ErrorCode code) { return code == ErrorCode::no_overlap || code == ErrorCode::ambiguous; }

/// Where the poses lie while their fixtures are part of the surface; two as the search has them first, fit they or not
/// in one way alone.
Result<std::vector<std::optional<Transform>>> sketch_poses(std::span<const PoseInput> inputs,
                                                           const PoseOptions& options, const Context& context) {
  if (inputs.size() > 2) {
    auto placed = place_poses(inputs, options, context);
    if (!placed) return pass_on(placed);
    return std::move(placed->model_from_pose);
  }
  std::vector<Candidate> fitting;
  const auto estimate = estimate_pose(inputs[0], inputs[1], options, context, fitting);
  if (!estimate && fitting.empty()) return pass_on(estimate);
  return std::vector<std::optional<Transform>>{Transform::Identity(), fitting.front().pose1_from_pose2};
}

}  // namespace

/// The fixtures under motions between the poses, taken out of the range images.
void Reconstruction::State::remove_fixtures(std::span<const std::optional<Transform>> model_from_pose) {
  std::vector<PlacedPose> placed;
  for (std::size_t p = 0; p < poses.size(); ++p) placed.push_back({poses[p].views, model_from_pose[p]});
  fixtures = find_fixtures(placed);
  for (std::size_t p = 0; p < poses.size(); ++p) {
    poses[p].in_front.clear();
    for (std::size_t v = 0; fixtures[p] && v < poses[p].views.size(); ++v) {
      poses[p].in_front.push_back(remove_fixture(*fixtures[p], poses[p].views[v].range));
    }
  }
}

void Reconstruction::State::drop_fixtures() {
  fixtures.clear();
  for (PoseState& pose : poses) pose.in_front.clear();
}

/// Of large images, whose range images wait in full for the integration.
void Reconstruction::State::remove_fixtures_in_full() {
  for (std::size_t p = 0; p < fixtures.size(); ++p) {
    for (std::size_t v = 0; fixtures[p] && v < poses[p].full.size(); ++v) {
      follow_thinned(poses[p].full[v], poses[p].views[v].range, step());
      RangeImage whole = poses[p].full[v].whole();
      std::ignore = remove_fixture(*fixtures[p], whole);
      poses[p].full[v] = CompactRange(whole);
    }
  }
}

/// Under the motions that contact gave: is there any? Few scans are looked at.
bool Reconstruction::State::shows_fixture(const FoundPoses& found) {
  if (found.seen_empty < kMinSeenEmpty) return false;
  std::vector<PlacedPose> placed;
  for (std::size_t p = 0; p < poses.size(); ++p) placed.push_back({poses[p].views, found.model_from_pose[p]});
  return any_fixture(find_fixtures(placed));
}

/// As find_touching(), without contact. Fixtures hide what they are until it is known how the object was turned over,
/// so that is sketched twice, with their surface and without most of it. `sketch`: the first, if it is known already. A
/// failure leaves the views as they were.
Result<Reconstruction::State::FoundPoses> Reconstruction::State::find_on_fixtures(const PoseOptions& pose_options,
                                                                                  const FoundPoses* sketch,
                                                                                  Report& report,
                                                                                  const Context& context) {
  std::vector<std::vector<View>> measured;  // share their pixels
  for (const PoseState& pose : poses) measured.push_back(pose.views);
  const auto restore = [&] {
    for (std::size_t p = 0; p < poses.size(); ++p) poses[p].views = measured[p];
    drop_fixtures();
  };
  if (sketch != nullptr) remove_fixtures(sketch->model_from_pose);
  for (const FixtureSurface surface : {FixtureSurface::whole, FixtureSurface::remains}) {
    if (surface == FixtureSurface::whole && sketch != nullptr) continue;
    std::vector<PoseInput> inputs;
    for (const PoseState& pose : poses) inputs.push_back({.solid = pose.partial.mesh, .views = pose.views});
    const auto sketched = sketch_poses(inputs, options_for_fixtures(pose_options, surface), context);
    restore();
    if (!sketched) return pass_on(sketched);
    remove_fixtures(*sketched);
  }
  auto found = find_touching(options_for_fixtures(pose_options, FixtureSurface::gone), report, context);
  restore();
  if (found) remove_fixtures(found->model_from_pose);
  return found;
}

/// With contact, as of an object that stands on the table; without it where the recipe has a fixture, or where only a
/// fixture explains what the poses show.
Result<Reconstruction::State::FoundPoses> Reconstruction::State::find_poses(Report& report, const Context& context) {
  if (poses.size() < 2) {
    if (options.fixture) disagreements.push_back(of_single_pose_on_fixture());
    return FoundPoses{.model_from_pose = {Transform::Identity()}};
  }
  const StageLog::Timer timer(log, "pose");
  auto pose_options = pose_options_of(options.rests);
  if (!pose_options) return pass_on(pose_options);
  pose_options->picked = options.picked;
  if (options.fixture) {
    auto found = find_on_fixtures(*pose_options, nullptr, report, context);
    if (found) note_fixtures(report);
    return found;
  }
  const auto before = disagreements;
  Report with_contact = report;
  auto found = find_touching(*pose_options, with_contact, context);
  if (found ? shows_fixture(*found) : fixture_may_explain(found.error().code)) {
    const auto after = std::exchange(disagreements, before);
    const auto with_contact_fit = choices;
    Report without_contact = report;
    auto held = find_on_fixtures(*pose_options, found ? &*found : nullptr, without_contact, context);
    if (held && any_fixture(fixtures)) {
      report = std::move(without_contact);
      note_fixtures(report);
      return held;
    }
    if (!held && held.error().code == ErrorCode::stopped) return held;
    drop_fixtures();
    disagreements = after;
    choices = with_contact_fit;
  }
  report = std::move(with_contact);
  return found;
}

/// Into the report, and out of what waits for the integration.
void Reconstruction::State::note_fixtures(Report& report) {
  remove_fixtures_in_full();
  for (std::size_t p = 0; p < fixtures.size(); ++p) {
    if (fixtures[p]) disagreements.push_back(of_fixture(p, *fixtures[p], options.fixture));
  }
  report.add_fixtures(fixtures);
}

}  // namespace scanrig
