#include "pipeline/reconstruct/memory.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <numbers>

#include "pipeline/range/thinned_view.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig {
namespace {

// Measured, peaks: two views of 12.6 MP at once 2660 MB, one by one 1725 MB; 16 views of 1.2 MP, one by one, 438 MiB
// before the integration and 565 MiB in it with voxels of 0.5 mm.
constexpr double kProgram = 300e6;
constexpr double kMatchedBytesPerPixel = 100.0;
constexpr double kKeptBytesPerPixel = 7.0;         // of a view as it is
constexpr double kKeptThinnedBytesPerPixel = 2.5;  // of one thinned and compact: a seventh is object
constexpr double kBytesPerSurfaceVoxel = 850.0;    // blocks, mesh, texture

double pixels_of(const Calibration& calibration) {
  return static_cast<double>(calibration.left.projection.width) * calibration.left.projection.height;
}

double kept_bytes(const Calibration& calibration, int views) {
  const bool is_thinned = thinning_step(calibration.left.projection) > 1;
  return (is_thinned ? kKeptThinnedBytesPerPixel : kKeptBytesPerPixel) * pixels_of(calibration) * views;
}

double gib(double bytes) { return bytes / (1U << 30); }

}  // namespace

std::uintmax_t min_memory(const Calibration& calibration, int views, double voxel_mm) {
  const double voxel = voxel_mm > 0 ? voxel_mm : kDefaultVoxelMm;
  // A cylinder as high as it is wide, lids included.
  const double radius = calibration.table_radius_mm / 2;
  const double area = 6 * std::numbers::pi * radius * radius;
  const double matched = kMatchedBytesPerPixel * pixels_of(calibration);
  const double model = kBytesPerSurfaceVoxel * area / (voxel * voxel);
  return static_cast<std::uintmax_t>(kProgram + kept_bytes(calibration, views) + std::max(matched, model));
}

Result<void> check_memory(const Calibration& calibration, int views, double voxel_mm, std::uintmax_t memory_bytes) {
  const std::uintmax_t needed = min_memory(calibration, views, voxel_mm);
  if (needed <= memory_bytes) return {};
  return fail(
      ErrorCode::out_of_range,
      "the reconstruction of {} views with voxels of {} mm needs at least {:.1f} GiB, memory_gib allows {:.1f}: "
      "use larger voxels or allow more",
      views, voxel_mm > 0 ? voxel_mm : kDefaultVoxelMm, gib(static_cast<double>(needed)),
      gib(static_cast<double>(memory_bytes)));
}

std::size_t views_at_once(const Calibration& calibration, int views, std::uintmax_t memory_bytes, std::size_t wanted) {
  const double room = static_cast<double>(memory_bytes) - kProgram - kept_bytes(calibration, views);
  const double fitting = room / (kMatchedBytesPerPixel * pixels_of(calibration));
  return static_cast<std::size_t>(std::clamp(fitting, 1.0, static_cast<double>(std::max<std::size_t>(wanted, 1))));
}

std::uintmax_t memory_left(std::uintmax_t memory_bytes) {
  std::uintmax_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  resident *= static_cast<std::uintmax_t>(sysconf(_SC_PAGESIZE));
  return memory_bytes > resident ? memory_bytes - resident : 0;
}

}  // namespace scanrig
