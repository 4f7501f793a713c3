#include "pipeline/evaluate/ideal_carve.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"

namespace scanrig {
namespace {

/// Distances are kept up to this many voxels.
constexpr float kClampVoxels = 4.0F;

/// Content of one image: distance of each pixel outside the outline, and depth of what it shows.
struct Evidence {
  const TrueImage* image = nullptr;
  cv::Mat1f outside_px;  ///< negative inside the outline
  cv::Mat3f point;       ///< observable, truth frame, at every second pixel; NaN elsewhere; empty: no such points
  cv::Mat3f normal;      ///< of the surface there
};

cv::Mat1f outline_distance(const TrueImage& image) {
  cv::Mat1b object, background;
  cv::compare(image.face, 0, object, cv::CMP_GE);
  cv::compare(image.face, 0, background, cv::CMP_LT);
  cv::Mat1f out, in, signed_distance;
  cv::distanceTransform(background, out, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(object, in, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  // The outline runs half-way between the pixels inside and outside it.
  cv::subtract(out, in, signed_distance);
  for (float& d : signed_distance) d += d > 0.0F ? -0.5F : 0.5F;
  return signed_distance;
}

Eigen::Vector3d normal_of(const Mesh& mesh, int face) {
  const Mesh::Face& f = mesh.faces[static_cast<std::size_t>(face)];
  const Eigen::Vector3d a = mesh.vertices[f[0]].cast<double>();
  return (mesh.vertices[f[1]].cast<double>() - a).cross(mesh.vertices[f[2]].cast<double>() - a).normalized();
}

Evidence evidence_of(const TrueImage& image, const TrueView& view, const Mesh& mesh, bool depth) {
  Evidence evidence{&image, outline_distance(image), {}, {}};
  if (!depth) return evidence;
  evidence.point = cv::Mat3f((image.depth.rows + 1) / 2, (image.depth.cols + 1) / 2, cv::Vec3f::all(std::nanf("")));
  evidence.normal = evidence.point.clone();
  const Transform truth_from_camera = image.camera.camera_from_turntable.inverse();
  parallel_for(static_cast<std::size_t>(evidence.point.rows), [&](std::size_t r) {
    const int row = static_cast<int>(r);
    for (int col = 0; col < evidence.point.cols; ++col) {
      const int face = image.face(2 * row, 2 * col);
      if (face < 0) continue;
      const double z = image.depth(2 * row, 2 * col);
      const Eigen::Vector3d ray = undistort(image.camera, {2.0 * col, 2.0 * row}).homogeneous();
      const Eigen::Vector3d point = truth_from_camera * (z * ray);
      const Eigen::Vector3d normal = normal_of(mesh, face);
      if (!view.observes(point, normal)) continue;
      for (int k = 0; k < 3; ++k) {
        evidence.point(row, col)[k] = static_cast<float>(point[k]);
        evidence.normal(row, col)[k] = static_cast<float>(normal[k]);
      }
    }
  });
  return evidence;
}

/// Distance outside the object by this evidence, mm; -infinity without evidence.
double outside(const Evidence& evidence, const Eigen::Vector3d& point) {
  const Camera& camera = evidence.image->camera;
  const Eigen::Vector2d px = camera.project(point);
  if (!camera.projection.contains(px, 1.0)) return -std::numeric_limits<double>::infinity();
  const double z = (camera.camera_from_turntable * point).z();
  const int col = static_cast<int>(std::lround(px.x())), row = static_cast<int>(std::lround(px.y()));
  const double beside = evidence.outside_px(row, col) * camera.projection.mm_per_pixel(z);
  if (evidence.point.empty()) return beside;
  // Along the ray, but through the tangent plane: the pixel's own ray passes a little beside the point.
  const cv::Vec3f& hit = evidence.point(row / 2, col / 2);
  const cv::Vec3f& normal = evidence.normal(row / 2, col / 2);
  const double before =
      (point - Eigen::Vector3d(hit[0], hit[1], hit[2])).dot(Eigen::Vector3d(normal[0], normal[1], normal[2]));
  return before > beside ? before : beside;  // NaN: beside
}

struct Cloud {
  const std::vector<Eigen::Vector3d>& points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

}  // namespace

IdealCarve::IdealCarve(const Mesh& truth, double voxel_mm) : voxel_(voxel_mm) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : truth.vertices) box.extend(vertex.cast<double>());
  // A hull from few views extends beyond the object; surface farther out than this is wrong, not closed.
  constexpr double kMargin = 15.0;
  origin_ = box.min().array() - kMargin;
  size_ = ((box.max().array() + kMargin - origin_.array()) / voxel_).ceil().cast<int>() + 1;
  outside_.assign(static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(),
                  -kClampVoxels * static_cast<float>(voxel_));
}

void IdealCarve::cut(const TrueView& view) {
  const Evidence left = evidence_of(view.left(), view, view.truth().mesh, true);
  const Evidence right = evidence_of(view.right(), view, view.truth().mesh, false);
  const float max_distance = kClampVoxels * static_cast<float>(voxel_);
  parallel_for(static_cast<std::size_t>(size_.z()), [&](std::size_t slice) {
    const int z = static_cast<int>(slice);
    for (int y = 0; y < size_.y(); ++y) {
      for (int x = 0; x < size_.x(); ++x) {
        float& value = outside_[index(x, y, z)];
        if (value >= max_distance) continue;
        const Eigen::Vector3d p = centre(x, y, z);
        const Eigen::Vector3d on_table = view.table_from_truth() * p;
        double d = std::max<double>(value, std::max(outside(left, p), outside(right, p)));
        if (std::hypot(on_table.x(), on_table.z()) < view.truth().table_radius_mm) d = std::max(d, -on_table.y());
        value = std::min(max_distance, static_cast<float>(d));
      }
    }
  });
}

std::vector<IdealCarve::Crossing> IdealCarve::crossings() const {
  std::vector<std::vector<Crossing>> slices(static_cast<std::size_t>(size_.z()));
  parallel_for(slices.size(), [&](std::size_t slice) {
    const int z = static_cast<int>(slice);
    const auto at = [&](const Eigen::Vector3i& v) {
      const Eigen::Vector3i w = v.cwiseMax(0).cwiseMin(size_ - Eigen::Vector3i::Ones());
      return static_cast<double>(outside_[index(w.x(), w.y(), w.z())]);
    };
    for (int y = 0; y < size_.y(); ++y) {
      for (int x = 0; x < size_.x(); ++x) {
        const Eigen::Vector3i here(x, y, z);
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3i next = here + Eigen::Vector3i::Unit(k);
          if (next[k] >= size_[k] || (at(here) > 0.0) == (at(next) > 0.0)) continue;
          const double t = at(here) / (at(here) - at(next));
          Eigen::Vector3d slope;
          for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3i step = Eigen::Vector3i::Unit(i);
            slope[i] = at(here + step) - at(here - step) + at(next + step) - at(next - step);
          }
          slices[slice].push_back({centre(x, y, z) + t * voxel_ * Eigen::Vector3d::Unit(k), slope.normalized()});
        }
      }
    }
  });
  std::vector<Crossing> all;
  for (const auto& slice : slices) all.insert(all.end(), slice.begin(), slice.end());
  return all;
}

std::vector<double> IdealCarve::distances(const std::vector<SurfaceSample>& samples) const {
  const std::vector<Crossing> surface = crossings();
  std::vector<double> result(samples.size(), std::nan(""));
  if (surface.empty()) return result;
  std::vector<Eigen::Vector3d> points;
  for (const Crossing& crossing : surface) points.push_back(crossing.point);
  const Cloud cloud{points};
  const nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, std::size_t> tree(
      3, cloud);
  constexpr std::size_t kBlock = 1024;
  parallel_for((samples.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(samples.size(), (block + 1) * kBlock); ++i) {
      std::size_t nearest = 0;
      double squared = 0.0;
      tree.knnSearch(samples[i].point.data(), 1, &nearest, &squared);
      const Eigen::Vector3d off = samples[i].point - points[nearest];
      const double height = std::abs(off.dot(surface[nearest].normal));
      const double beside = std::sqrt(std::max(0.0, squared - height * height));
      // Between neighbouring crossings the tangent plane replaces the surface.
      result[i] = beside <= voxel_ ? height : std::sqrt(squared);
    }
  });
  return result;
}

}  // namespace scanrig
