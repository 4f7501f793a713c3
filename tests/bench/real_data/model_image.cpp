// bench_model_image MODEL.ply AZIMUTH_DEG ELEVATION_DEG OUT: a shaded image of a model for the documentation, seen from
// afar. Measured surface is grey; surface closed without measurement (`views` 0) is orange.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/model_io/mesh_reader.h"

namespace {

using namespace scanrig;

constexpr int kWidth = 900, kSamples = 2;  // px; samples per px and axis
constexpr double kMarginMm = 4.0;

cv::Vec3b shade(const Mesh& mesh, const SurfaceIndex::Hit& hit, const Eigen::Vector3d& towards_eye,
                const Eigen::Vector3d& light) {
  const Mesh::Face& face = mesh.faces[hit.face];
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  bool measured = true;
  for (int k = 0; k < 3; ++k) {
    normal += hit.weights[k] * mesh.normals[face[k]];
    measured = measured && (mesh.views.empty() || mesh.views[face[k]] > 0);
  }
  const Eigen::Vector3d n = normal.cast<double>().normalized();
  const double bright = 0.15 + 0.65 * std::max(0.0, n.dot(light)) + 0.2 * std::max(0.0, n.dot(towards_eye));
  const cv::Vec3d colour = measured ? cv::Vec3d(225, 225, 225) : cv::Vec3d(60, 140, 240);  // BGR
  return {cv::saturate_cast<uchar>(bright * colour[0]), cv::saturate_cast<uchar>(bright * colour[1]),
          cv::saturate_cast<uchar>(bright * colour[2])};
}

cv::Mat3b draw(const Mesh& mesh, const SurfaceIndex& surface, double azimuth, double elevation) {
  const Eigen::Matrix3d world_from_eye =
      (Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(-elevation, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(Eigen::Vector3d(world_from_eye.transpose() * v.cast<double>()));
  const double step = (box.sizes().x() + 2 * kMarginMm) / (kWidth * kSamples);
  const int rows = static_cast<int>((box.sizes().y() + 2 * kMarginMm) / step);
  const Eigen::Vector3d eye = world_from_eye.col(2);
  const Eigen::Vector3d light = world_from_eye * Eigen::Vector3d(-0.5, 0.7, 0.6).normalized();
  cv::Mat3b image(rows, kWidth * kSamples, cv::Vec3b(255, 255, 255));
  parallel_for(static_cast<std::size_t>(rows), [&](std::size_t row) {
    for (int col = 0; col < image.cols; ++col) {
      const Eigen::Vector3d start(box.min().x() - kMarginMm + step * col,
                                  box.max().y() + kMarginMm - step * static_cast<double>(row), box.max().z() + 1.0);
      const auto hit = surface.first_hit(world_from_eye * start, -eye);
      if (hit) image(static_cast<int>(row), col) = shade(mesh, *hit, eye, light);
    }
  });
  cv::resize(image, image, {}, 1.0 / kSamples, 1.0 / kSamples, cv::INTER_AREA);
  return image;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "usage: bench_model_image MODEL.ply AZIMUTH_DEG ELEVATION_DEG OUT\n");
    return static_cast<int>(ExitCode::usage);
  }
  const auto mesh = read_ply(argv[1]);
  const auto surface = mesh ? SurfaceIndex::create(*mesh) : pass_on(mesh);
  if (!surface) {
    fmt::print(stderr, "{}\n", surface.error().message);
    return static_cast<int>(exit_code(surface.error().code));
  }
  const auto image = draw(*mesh, *surface, to_radians(std::atof(argv[2])), to_radians(std::atof(argv[3])));
  return cv::imwrite(argv[4], image, {cv::IMWRITE_JPEG_QUALITY, 88}) ? 0 : 1;
}
