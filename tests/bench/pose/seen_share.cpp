// bench_seen_share SCAN MODEL: how much of what can be seen of an object at all a model has measured. A point can be
// seen if the object, held in any way, leaves the sight of both cameras and the projector free; the sight lines of a
// rig far away. Writes JSON to standard output: shares of the true surface that can be seen, and of that what lies
// within reach of measured surface, of the model and pose by pose of what the truth's views could show.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "core/parallel_blocks.h"
#include "core/units.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/mesh/topology.h"

namespace {

using namespace scanrig;

constexpr std::size_t kSamples = 20'000;
constexpr int kDirections = 600;  // of sight, over the whole sphere
constexpr int kRolls = 6;         // of the rig about each
constexpr double kMaxIncidenceDeg = 70.0, kHalfBaselineDeg = 7.1, kProjectorDeg = 8.0;
constexpr double kFarMm = 640.0, kLiftMm = 0.05;
constexpr double kReachMm = 0.25;  // between true and measured surface, at half resolution

using Sight = std::array<Eigen::Vector3d, 3>;  // unit directions towards left and right camera and projector

std::vector<Sight> sights() {
  std::vector<Sight> all;
  for (int i = 0; i < kDirections; ++i) {
    const double y = 1.0 - 2.0 * (i + 0.5) / kDirections, turn = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    const double radius = std::sqrt(1.0 - y * y);
    const Eigen::Vector3d middle(radius * std::cos(turn), y, radius * std::sin(turn));
    const Eigen::Vector3d any = middle.unitOrthogonal();
    for (int roll = 0; roll < kRolls; ++roll) {
      const Eigen::Vector3d side = Eigen::AngleAxisd(2.0 * std::numbers::pi * roll / kRolls, middle) * any,
                            up = middle.cross(side);
      const double across = std::tan(to_radians(kHalfBaselineDeg)), above = std::tan(to_radians(kProjectorDeg));
      all.push_back({(middle - across * side).normalized(), (middle + across * side).normalized(),
                     (middle + above * up).normalized()});
    }
  }
  return all;
}

bool can_be_seen(const SurfaceSample& sample, const SurfaceIndex& surface, const std::vector<Sight>& all) {
  const double min_cosine = std::cos(to_radians(kMaxIncidenceDeg));
  const Eigen::Vector3d from = sample.point + kLiftMm * sample.normal;
  return std::ranges::any_of(all, [&](const Sight& sight) {
    return std::ranges::all_of(sight, [&](const Eigen::Vector3d& d) { return d.dot(sample.normal) > min_cosine; }) &&
           std::ranges::none_of(
               sight, [&](const Eigen::Vector3d& d) { return surface.blocked(from, sample.point + kFarMm * d); });
  });
}

Result<nlohmann::json> measure(const std::filesystem::path& scan, const std::filesystem::path& model) {
  auto truth = read_truth(scan);
  if (!truth) return pass_on(truth);
  auto claim = read_claim(model);
  if (!claim) return pass_on(claim);
  Mesh& mesh = claim->model.mesh;
  if (claim->frame_of_pose < truth->poses.size()) {
    const Transform truth_from_frame = truth->poses[claim->frame_of_pose].table_from_truth.inverse();
    for (auto& v : mesh.vertices) v = (truth_from_frame * v.cast<double>()).cast<float>();
  }
  truth->mesh = joined_vertices(truth->mesh);
  const auto surface = SurfaceIndex::create(truth->mesh);
  if (!surface) return pass_on(surface);
  const auto measured = SurfaceIndex::create(mesh, measured_faces(mesh, true));
  if (!measured) return pass_on(measured);
  Mesh bare;
  bare.vertices = truth->mesh.vertices;
  bare.faces = truth->mesh.faces;
  const auto samples = sample_surface(bare, measured_faces(bare, true), kSamples);
  const auto all = sights();
  std::vector<std::uint8_t> visible(samples.size()), seen(samples.size());
  for_each_in_blocks(samples.size(), [&](std::size_t i) {
    visible[i] = can_be_seen(samples[i], *surface, all) ? 1 : 0;
    seen[i] = measured->nearest(samples[i].point, 2.0 * kReachMm).distance <= kReachMm ? 1 : 0;
  });
  std::size_t both = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) both += visible[i] && seen[i] ? 1 : 0;
  const auto can = static_cast<double>(std::ranges::count(visible, 1));
  nlohmann::json unseen_after = nlohmann::json::array();  // the views' own limit, without errors of matching
  std::vector<int> views(samples.size(), 0);
  const std::vector<TruePose> poses = std::exchange(truth->poses, {});
  for (const TruePose& pose : poses) {
    truth->poses = {pose};
    const auto here = observable_views(samples, *truth, *surface, {});
    double shown = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      views[i] += here[i];
      shown += visible[i] && views[i] > 0 ? 1.0 : 0.0;
    }
    unseen_after.push_back(1.0 - shown / can);
  }
  return nlohmann::json{{"visible", can / static_cast<double>(samples.size())},
                        {"unseen", 1.0 - static_cast<double>(both) / can},
                        {"unseen_after_poses", unseen_after}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: bench_seen_share SCAN MODEL\n");
    return static_cast<int>(ExitCode::usage);
  }
  Result<nlohmann::json> json = fail(ErrorCode::internal, "not measured");
  with_threads(0, [&] { json = measure(argv[1], argv[2]); });
  if (!json) {
    fmt::print(stderr, "{}\n", json.error().message);
    return static_cast<int>(exit_code(json.error().code));
  }
  fmt::print("{}\n", json->dump());
  return 0;
}
