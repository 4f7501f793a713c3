#include "pipeline/reconstruct/memory.h"

#include <numbers>

#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig {
namespace {

// Measured with 16 views of 1280x960 and voxels of 0.25 mm, report.json's process_peak_memory_mib: 1240 to 1370 MiB
// before the integration (without the 2 bytes per pixel of grey patterns), 170 to 375 MiB more for models of 13,400 to
// 22,400 mm2.
constexpr double kProgram = 200e6;
constexpr double kBytesPerPixel = 74.0;
constexpr double kBytesPerSurfaceVoxel = 1100.0;

}  // namespace

std::uintmax_t estimated_memory(const Calibration& calibration, int views, double voxel_mm) {
  const double voxel = voxel_mm > 0 ? voxel_mm : kDefaultVoxelMm;
  const auto& image = calibration.left.projection;
  const double pixels = static_cast<double>(image.width) * image.height * views;
  // A cylinder as high as it is wide, lids included.
  const double radius = calibration.table_radius_mm / 2;
  const double area = 6 * std::numbers::pi * radius * radius;
  return static_cast<std::uintmax_t>(kProgram + kBytesPerPixel * pixels +
                                     kBytesPerSurfaceVoxel * area / (voxel * voxel));
}

}  // namespace scanrig
