// bench_large WIDTH VIEWS VOXEL_MM MEMORY_GIB: views of an object of 200 mm by cameras of WIDTH pixels (4 to 3), each
// made by intersecting rays with spheres, cropped, thinned and made compact as a reconstruction does, then integrated
// within MEMORY_GIB (0: without limit). Prints JSON: seconds, peak memory, bytes a measured pixel, places, the
// surface's hash.

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/hash.h"
#include "core/heap.h"
#include "core/parallel.h"
#include "pipeline/range/crop_view.h"
#include "pipeline/range/thinned_view.h"
#include "pipeline/reconstruct/memory.h"
#include "pipeline/silhouette/contour_distance.h"
#include "pipeline/volume/integrate.h"

namespace {

using namespace scanrig;

struct Ball {
  Eigen::Vector3d centre;
  double radius;
};

/// 200 mm high, with grooves where balls meet, standing on y = 0. The last three are a handle: a surface with handles
/// is looked through for those that nothing measured, at a cost in memory.
using Balls = std::array<Ball, 9>;
const Balls kObject = {Ball{{0, 55, 0}, 55}, {{10, 130, 0}, 40},   {{0, 170, 0}, 30},
                       {{60, 80, 10}, 25},   {{-55, 90, -15}, 28}, {{15, 120, 45}, 22},
                       {{80, 105, 8}, 12},   {{82, 125, 6}, 15},   {{60, 142, 3}, 14}};

/// An error of depth that any machine repeats: the same for a pixel of a view, -1 to 1.
double noise_at(int u, int v, int view) {
  std::uint32_t h = static_cast<std::uint32_t>(u) * 0x9E3779B1U ^ static_cast<std::uint32_t>(v) * 0x85EBCA77U ^
                    static_cast<std::uint32_t>(view) * 0xC2B2AE3DU;
  h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
  return static_cast<double>(h >> 8) / (1U << 23) - 1.0;
}

/// Twice the default rig's distance, whose object is 100 mm high.
View empty_view(int width, int view, int views) {
  constexpr double kDistance = 1000.0;
  View made{.index = view, .range = {}, .silhouettes = std::vector<Silhouette>(1)};
  const int height = width * 3 / 4;
  Projection& p = made.range.projection;
  p = {.width = width, .height = height, .fx = 3.0 * width, .fy = 3.0 * width, .cx = width / 2.0, .cy = height / 2.0};
  const double azimuth = 2 * std::numbers::pi * view / views, up = 0.4;
  const Eigen::Vector3d towards(std::cos(up) * std::sin(azimuth), std::sin(up), std::cos(up) * std::cos(azimuth));
  const Eigen::Vector3d z = -towards, x = Eigen::Vector3d::UnitY().cross(towards).normalized(), y = z.cross(x);
  Transform& pose = made.range.camera_from_pose;
  pose.linear() << x.transpose(), y.transpose(), z.transpose();
  pose.translation() = -(pose.linear() * (Eigen::Vector3d(0, 95, 0) + kDistance * towards));
  made.range.window_px = 6.0F;
  return made;
}

void measure_pixel(View& view, const Balls& object, int u, int v) {
  constexpr double kMinFacing = 0.3, kNoiseMm = 0.015;
  RangeImage& range = view.range;
  const Eigen::Vector3d ray = range.projection.unproject(u, v, 1.0);
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal;
  for (const Ball& ball : object) {
    const double a = ray.squaredNorm(), b = ray.dot(ball.centre);
    const double root = b * b - a * (ball.centre.squaredNorm() - ball.radius * ball.radius);
    if (root < 0.0 || (b - std::sqrt(root)) / a >= nearest) continue;
    nearest = (b - std::sqrt(root)) / a;
    normal = (nearest * ray - ball.centre) / ball.radius;
  }
  const bool is_object = std::isfinite(nearest);
  view.silhouettes.front().outside_px(v, u) = is_object ? -0.5F : 0.5F;
  range.background(v, u) = is_object ? 0 : 255;
  if (!is_object || -normal.dot(ray.normalized()) < kMinFacing) return;
  range.depth(v, u) = static_cast<float>(nearest + kNoiseMm * noise_at(u, v, view.index));
  range.sigma(v, u) = static_cast<float>(0.6 * kNoiseMm / -normal.dot(ray.normalized()));
  range.normal(v, u) =
      cv::Vec3f(static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z()));
}

View take_view(int width, int view, int views) {
  View made = empty_view(width, view, views);
  RangeImage& range = made.range;
  Balls object = kObject;
  for (Ball& ball : object) ball.centre = range.camera_from_pose * ball.centre;
  const cv::Size size(range.projection.width, range.projection.height);
  range.depth = cv::Mat1f(size, kUnmeasured);
  range.sigma = cv::Mat1f(size, kUnmeasured);
  range.normal = cv::Mat3f(size, cv::Vec3f(kUnmeasured, kUnmeasured, kUnmeasured));
  range.background = cv::Mat1b(size, uchar{0});
  Silhouette& silhouette = made.silhouettes.front();
  silhouette = {range.projection, range.camera_from_pose, cv::Mat1f(size)};
  parallel_for(static_cast<std::size_t>(size.height), [&](std::size_t v) {
    for (int u = 0; u < size.width; ++u) measure_pixel(made, object, u, static_cast<int>(v));
  });
  crop_to_object_in_steps(made, thinning_step(range.projection));
  silhouette.outside_px = contour_distance(silhouette.outside_px);
  return made;
}

double peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

std::string hash_of(const Mesh& mesh) {
  const auto bytes = [](const auto& values) { return std::as_bytes(std::span(values.data(), values.size())); };
  return sha256(sha256(bytes(mesh.vertices)) + sha256(bytes(mesh.faces)) + sha256(bytes(mesh.sigma)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  keep_heaps_small();
  const int width = std::atoi(argv[1]), views = std::atoi(argv[2]);
  const double gib = std::atof(argv[4]);
  VolumeOptions options{.voxel_mm = std::atof(argv[3]), .table_without_silhouettes = true};
  std::vector<View> thin;
  std::vector<CompactRange> full;
  std::size_t measured = 0, bytes = 0;
  for (int v = 0; v < views; ++v) {
    const View whole = take_view(width, v, views);
    const Projection& p = whole.range.projection;
    full.emplace_back(whole.range);
    thin.push_back(thinned(whole, thinning_step({.width = p.sensor_width, .height = p.sensor_height})));
    measured += full.back().measured();
    bytes += full.back().bytes();
  }
  const PosedViews posed{.views = thin, .full = full};
  options.band_mm = evidence_band({&posed, 1}, options);
  for (View& view : thin) release_matrices(view.range);
  give_memory_back();
  if (gib > 0.0) options.memory_bytes = memory_left(static_cast<std::uintmax_t>(gib * (1U << 30)));
  const double kept_mib = peak_mib();
  const auto start = std::chrono::steady_clock::now();
  const auto surface = integrate({&posed, 1}, options);
  if (!surface) {
    fmt::print(stderr, "{}\n", surface.error().message);
    return 1;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  fmt::print("{}\n", nlohmann::json{{"seconds", seconds},
                                    {"kept_mib", kept_mib},
                                    {"peak_mib", peak_mib()},
                                    {"bytes_per_pixel", static_cast<double>(bytes) / static_cast<double>(measured)},
                                    {"measured_pixels", measured},
                                    {"places", surface->report.bricks},
                                    {"vertices", surface->mesh.vertices.size()},
                                    {"genus", surface->report.genus},
                                    {"hash", hash_of(surface->mesh)}}
                         .dump());
  return 0;
}
