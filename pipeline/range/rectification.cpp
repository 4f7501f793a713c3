#include "pipeline/range/rectification.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "pipeline/exposures/merge_exposures.h"
#include "pipeline/range/disparity_range.h"
#include "pipeline/range/spline.h"

namespace scanrig {
namespace {

/// Axes of the common frame, as rows: x along the baseline, z as near as possible to both lines of sight.
Result<Eigen::Matrix3d> common_axes(const Calibration& calibration, const Eigen::Vector3d& baseline) {
  const Eigen::Matrix3d left = calibration.left.camera_from_turntable.linear();
  const Eigen::Matrix3d right = calibration.right.camera_from_turntable.linear();
  const Eigen::Vector3d sight = (left.row(2) + right.row(2)).transpose();
  const Eigen::Vector3d x = baseline.normalized();
  const Eigen::Vector3d z = sight - x * x.dot(sight);
  if (!(z.norm() > 0.2 * sight.norm()) || !(sight.norm() > 0.1)) {
    return fail(ErrorCode::invalid_input,
                "rectify: the cameras do not look in the same direction across their baseline");
  }
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(2) = z.normalized();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return axes;
}

/// A pinhole camera with the same line of sight through its middle as the camera.
Projection centred(const Camera& camera, const Transform& rectified_from_turntable, double focal) {
  Projection p = camera.projection;
  const Transform rectified_from_camera = rectified_from_turntable * camera.camera_from_turntable.inverse();
  const double u = (p.width - 1) / 2.0, v = (p.height - 1) / 2.0;
  const Eigen::Vector3d centre = rectified_from_camera.linear() * p.unproject(u, v, 1.0);
  p.fx = p.fy = focal;
  p.cx = u - focal * centre.x() / centre.z();
  p.cy = v - focal * centre.y() / centre.z();
  return p;
}

RectifyingMap make_map(const Camera& camera, const Projection& projection, const Transform& rectified_from_turntable) {
  RectifyingMap map{cv::Mat1f(projection.height, projection.width), cv::Mat1f(projection.height, projection.width)};
  const Transform turntable_from_rectified = rectified_from_turntable.inverse();
  parallel_for(static_cast<std::size_t>(projection.height), [&](std::size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < projection.width; ++u) {
      // Any depth does: both frames share the centre of projection.
      const Eigen::Vector2d pixel = camera.project(turntable_from_rectified * projection.unproject(u, v, 500.0));
      map.u(v, u) = static_cast<float>(pixel.x());
      map.v(v, u) = static_cast<float>(pixel.y());
    }
  });
  return map;
}

Result<void> check_image(const RectifyingMap& map, const cv::Mat& image) {
  const bool is_of_sensor = image.depth() == CV_8U || image.depth() == CV_16U;
  if (image.type() != CV_32FC1 && !(is_of_sensor && (image.channels() == 1 || image.channels() == 3))) {
    return fail(ErrorCode::invalid_input,
                "rectify: an image must have 8 or 16 bits and one or three channels, or be grey values");
  }
  if (image.size() != map.u.size()) {
    return fail(ErrorCode::invalid_input, "rectify: the image has {}x{} pixels, the calibration {}x{}", image.cols,
                image.rows, map.u.cols, map.u.rows);
  }
  return {};
}

void resample_row(const cv::Mat1f& coefficients, const cv::Point& first, const float* us, const float* vs, float* out,
                  int width) {
  const float u_last = static_cast<float>(coefficients.cols - 1), v_last = static_cast<float>(coefficients.rows - 1);
  for (int x = 0; x < width; ++x) {
    const float u = std::clamp(us[x] - static_cast<float>(first.x), 0.0f, u_last);
    const float v = std::clamp(vs[x] - static_cast<float>(first.y), 0.0f, v_last);
    const int column = static_cast<int>(u), line = static_cast<int>(v);
    const auto across = spline_weights(u - static_cast<float>(column));
    const auto down = spline_weights(v - static_cast<float>(line));
    float value = 0.0f;
    for (int j = 0; j < 4; ++j) {
      const float* c = coefficients[std::clamp(line + j - 1, 0, coefficients.rows - 1)];
      float sum = 0.0f;
      for (int i = 0; i < 4; ++i) {
        sum += across[static_cast<std::size_t>(i)] * c[std::clamp(column + i - 1, 0, coefficients.cols - 1)];
      }
      value += down[static_cast<std::size_t>(j)] * sum;
    }
    out[x] = value;
  }
}

template <class Value>
cv::Mat1f weighted_grey(const cv::Mat& image, float scale) {
  cv::Mat1f grey(image.size());
  for (int y = 0; y < image.rows; ++y) {
    const auto* bgr = image.ptr<cv::Vec<Value, 3>>(y);
    float* out = grey[y];
    for (int x = 0; x < image.cols; ++x)
      out[x] = 0.25f * scale * static_cast<float>(bgr[x][0] + 2 * bgr[x][1] + bgr[x][2]);
  }
  return grey;
}

cv::Mat1f grey_values(const cv::Mat& image) {
  const bool is_merged = image.depth() == CV_16U;
  const float scale = is_merged ? 1.0f / static_cast<float>(kMergedUnitsPerGrey) : 1.0f;
  if (image.channels() == 3)
    return is_merged ? weighted_grey<ushort>(image, scale) : weighted_grey<uchar>(image, scale);
  cv::Mat1f grey;
  image.convertTo(grey, CV_32F, static_cast<double>(scale));
  return grey;
}

}  // namespace

Result<Rectification> rectify(const Calibration& calibration, const WorkingVolume& volume) {
  const Projection &a = calibration.left.projection, &b = calibration.right.projection;
  if (a.width < 16 || a.height < 16 || a.width != b.width || a.height != b.height) {
    return fail(ErrorCode::invalid_input, "rectify: the calibration gives images of {}x{} and {}x{} pixels", a.width,
                a.height, b.width, b.height);
  }
  if (!(a.fx > 0) || !(a.fy > 0) || !(b.fx > 0) || !(b.fy > 0)) {
    return fail(ErrorCode::invalid_input, "rectify: the calibration has no focal length");
  }
  const Eigen::Vector3d left_centre = calibration.left.camera_from_turntable.inverse().translation();
  const Eigen::Vector3d right_centre = calibration.right.camera_from_turntable.inverse().translation();
  Rectification r;
  r.baseline_mm = (right_centre - left_centre).norm();
  r.table_radius_mm = calibration.table_radius_mm;
  if (!(r.baseline_mm > 1e-3)) return fail(ErrorCode::invalid_input, "rectify: both cameras are in the same place");
  const auto axes = common_axes(calibration, right_centre - left_centre);
  if (!axes) return pass_on(axes);

  r.left_from_turntable.linear() = r.right_from_turntable.linear() = *axes;
  r.left_from_turntable.translation() = -(*axes * left_centre);
  r.right_from_turntable.translation() = -(*axes * right_centre);
  const double focal = (a.fx + a.fy + b.fx + b.fy) / 4.0;
  r.left = centred(calibration.left, r.left_from_turntable, focal);
  r.right = centred(calibration.right, r.right_from_turntable, focal);
  r.left.cy = r.right.cy = (r.left.cy + r.right.cy) / 2.0;
  if (!find_disparities(r, volume)) {
    return fail(ErrorCode::out_of_range, "rectify: no part of the space above the table is seen by both cameras");
  }
  r.left_map = make_map(calibration.left, r.left, r.left_from_turntable);
  r.right_map = make_map(calibration.right, r.right, r.right_from_turntable);
  return r;
}

Result<cv::Mat> rectified(const RectifyingMap& map, const cv::Mat& image, Resampling resampling) {
  if (const auto fits = check_image(map, image); !fits) return pass_on(fits);
  cv::Mat out;
  cv::remap(image, out, map.u, map.v, resampling == Resampling::cubic ? cv::INTER_CUBIC : cv::INTER_LINEAR,
            cv::BORDER_REPLICATE);
  return out;
}

cv::Rect sensor_box(const RectifyingMap& map, const cv::Rect& box, int room_px) {
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
  cv::minMaxLoc(map.u(box), &left, &right);
  cv::minMaxLoc(map.v(box), &top, &bottom);
  const cv::Point first(static_cast<int>(std::floor(left)) - room_px, static_cast<int>(std::floor(top)) - room_px);
  const cv::Point end(static_cast<int>(std::ceil(right)) + room_px, static_cast<int>(std::ceil(bottom)) + room_px);
  return cv::Rect(first, end) & cv::Rect({0, 0}, map.u.size());
}

Result<cv::Mat1f> rectified_grey(const RectifyingMap& map, const cv::Mat& image, const cv::Rect& part) {
  if (const auto fits = check_image(map, image); !fits) return pass_on(fits);
  cv::Mat1f out(map.u.size(), 0.0F);
  const cv::Rect box = part.empty() ? cv::Rect({0, 0}, out.size()) : part;
  constexpr int kRoom = 20;  // px: farther out nothing matters to the spline
  const cv::Rect sensor = sensor_box(map, box, kRoom);
  if (sensor.empty()) return out;
  const cv::Mat1f coefficients = spline_coefficients(grey_values(image(sensor)));
  parallel_for(static_cast<std::size_t>(box.height), [&](std::size_t row) {
    const int y = box.y + static_cast<int>(row);
    resample_row(coefficients, sensor.tl(), map.u[y] + box.x, map.v[y] + box.x, out[y] + box.x, box.width);
  });
  return out;
}

}  // namespace scanrig
