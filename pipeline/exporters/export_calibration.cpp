#include "pipeline/exporters/export_calibration.h"

#include <fmt/ranges.h>

#include "core/units.h"

namespace scanrig {
namespace {

const Camera& camera_of(const Calibration& calibration, std::size_t side) {
  return side == 0 ? calibration.left : calibration.right;
}

const char* side_name(std::size_t side) { return side == 0 ? "left" : "right"; }

/// The shortest text that reads back as the same number, with a point or an exponent: a real number everywhere.
std::string exact(double value) {
  std::string text = fmt::format("{}", value == 0.0 ? 0.0 : value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string list_of(const std::vector<double>& values, std::string_view between) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(exact(value));
  return fmt::format("{}", fmt::join(texts, between));
}

std::vector<double> intrinsics_of(const OpenCvLens& lens, std::size_t coefficients) {
  std::vector<double> values{lens.fx, lens.fy, lens.cx, lens.cy};
  values.insert(values.end(), lens.distortion.begin(),
                lens.distortion.begin() + static_cast<std::ptrdiff_t>(coefficients));
  return values;
}

/// Without what would end a comment.
std::string one_line(std::string text) {
  std::erase_if(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  return text;
}

/// First lines of a file: what it is, what is lost.
std::string comment_of(const Calibration& calibration, const CalibrationExport& exported, std::size_t side) {
  const std::string serial = one_line(camera_of(calibration, side).serial), date = one_line(calibration.date);
  std::string out = fmt::format("# {} camera{}{}, calibrated {}; lengths in mm\n", side_name(side),
                                serial.empty() ? "" : " ", serial, date.empty() ? "at an unknown date" : date);
  const std::string lost = what_is_lost(exported, side);
  return lost.empty() ? out : out + "# " + lost + "\n";
}

/// OpenCV's order of a matrix, row after row.
std::vector<double> rows_of(const Eigen::MatrixXd& matrix) {
  std::vector<double> values;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) values.push_back(matrix(r, c));
  }
  return values;
}

std::string yaml_matrix(std::string_view name, const Eigen::MatrixXd& matrix) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", name, matrix.rows(),
                     matrix.cols(), list_of(rows_of(matrix), ", "));
}

}  // namespace

std::string what_is_lost(const CalibrationExport& exported, std::size_t side) {
  const LensFit& fit = exported.lenses[side];
  if (fit.max_px == 0.0) return "";
  return fmt::format("{} camera: {} does not hold the lens field: {:.4f} px rms over the image, {:.4f} px at most",
                     side_name(side), exported.lens_model, fit.rms_px, fit.max_px);
}

CalibrationExport export_mrcal(const Calibration& calibration) {
  constexpr std::array<std::size_t, 3> kCounts{5, 8, 12};
  CalibrationExport out;
  std::size_t count = 5;
  for (std::size_t side = 0; side < 2; ++side) {
    out.lenses[side] = fit_lens(camera_of(calibration, side), kCounts);
    count = std::max(count, out.lenses[side].lens.count);
  }
  out.lens_model = fmt::format("LENSMODEL_OPENCV{}", count);
  for (std::size_t side = 0; side < 2; ++side) {
    const Camera& camera = camera_of(calibration, side);
    const Eigen::AngleAxisd turn(camera.camera_from_turntable.linear());
    const Eigen::Vector3d r = turn.angle() * turn.axis(), t = camera.camera_from_turntable.translation();
    std::string text = comment_of(calibration, out, side);
    text += "# The reference frame is the turntable's: y up along its axis, y = 0 the table top.\n{\n";
    text += fmt::format("    'lensmodel':  '{}',\n\n", out.lens_model);
    text += "    # fx, fy, cx, cy, then the coefficients in OpenCV's order; pixel centres at integers\n";
    text += fmt::format("    'intrinsics': [ {},],\n\n", list_of(intrinsics_of(out.lenses[side].lens, count), ", "));
    text += "    # rt_fromref: Rodrigues vector, then translation, of the camera from the reference frame\n";
    text += fmt::format("    'extrinsics': [ {},],\n\n", list_of({r.x(), r.y(), r.z(), t.x(), t.y(), t.z()}, ", "));
    text += fmt::format("    'imagersize': [ {}, {},]\n}}\n", camera.projection.width, camera.projection.height);
    out.files.push_back({fmt::format("{}.cameramodel", side_name(side)), text});
  }
  return out;
}

CalibrationExport export_opencv(const Calibration& calibration) {
  constexpr std::array<std::size_t, 4> kCounts{5, 8, 12, 14};
  CalibrationExport out;
  for (std::size_t side = 0; side < 2; ++side) out.lenses[side] = fit_lens(camera_of(calibration, side), kCounts);
  const std::size_t count = std::max(out.lenses[0].lens.count, out.lenses[1].lens.count);
  out.lens_model = fmt::format("OpenCV's model of {} coefficients", count);
  std::string text = "%YAML:1.0\n---\n" + comment_of(calibration, out, 0) + comment_of(calibration, out, 1);
  text += "# As of cv::stereoCalibrate(): 1 is the left camera; x2 = R x1 + T.\n";
  text += fmt::format("image_width: {}\nimage_height: {}\n", calibration.left.projection.width,
                      calibration.left.projection.height);
  for (std::size_t side = 0; side < 2; ++side) {
    const OpenCvLens& lens = out.lenses[side].lens;
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = lens.fx;
    k(1, 1) = lens.fy;
    k(0, 2) = lens.cx;
    k(1, 2) = lens.cy;
    text += yaml_matrix(fmt::format("K{}", side + 1), k);
    text += yaml_matrix(fmt::format("D{}", side + 1),
                        Eigen::Map<const Eigen::RowVectorXd>(lens.distortion.data(), static_cast<Eigen::Index>(count)));
  }
  const Transform right_from_left =
      calibration.right.camera_from_turntable * calibration.left.camera_from_turntable.inverse();
  text += yaml_matrix("R", right_from_left.linear()) + yaml_matrix("T", right_from_left.translation());
  text += "# 4 x 4: a point of the left camera's frame to the turntable's, y up along its axis, y = 0 the table top\n";
  text += yaml_matrix("turntable_from_left", calibration.left.camera_from_turntable.inverse().matrix());
  out.files.push_back({"calibration.yaml", text});
  return out;
}

std::string colmap_image_name(std::size_t pose, const ViewRecord& view, std::size_t side) {
  return fmt::format("pose{}/view{:02}_{}.png", pose + 1, view.index, side_name(side));
}

namespace {

constexpr double kColmapCentre = 0.5;  ///< COLMAP's coordinates of the first pixel's centre

std::string colmap_cameras(const Calibration& calibration, const CalibrationExport& exported) {
  std::string text = comment_of(calibration, exported, 0) + comment_of(calibration, exported, 1);
  text += "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  text += "# Number of cameras: 2\n";
  for (std::size_t side = 0; side < 2; ++side) {
    const Projection& p = camera_of(calibration, side).projection;
    OpenCvLens lens = exported.lenses[side].lens;
    lens.cx += kColmapCentre;
    lens.cy += kColmapCentre;
    text += fmt::format("{} FULL_OPENCV {} {} {}\n", side + 1, p.width, p.height, list_of(intrinsics_of(lens, 8), " "));
  }
  return text;
}

std::string colmap_images(const Calibration& calibration, const Manifest& manifest, std::size_t pose,
                          ColmapNames names) {
  const std::vector<ViewRecord>& views = manifest.poses[pose].views;
  std::string text =
      "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  text += fmt::format("# Number of images: {}, mean observations per image: 0\n", 2 * views.size());
  int id = 0;
  for (const ViewRecord& view : views) {
    for (std::size_t side = 0; side < 2; ++side) {
      const Transform camera_from_object =
          camera_of(calibration, side).camera_from_turntable * rot_y(to_radians(view.measured_deg));
      Eigen::Quaterniond q(camera_from_object.linear());
      if (q.w() < 0.0) q.coeffs() = -q.coeffs();
      const Eigen::Vector3d t = camera_from_object.translation();
      const std::string name = names == ColmapNames::of_copy
                                   ? colmap_image_name(pose, view, side)
                                   : view.files.at(side == 0 ? "left_plain" : "right_plain").path;
      text += fmt::format("{} {} {} {}\n\n", ++id, list_of({q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}, " "),
                          side + 1, name);
    }
  }
  return text;
}

}  // namespace

Result<CalibrationExport> export_colmap(const Calibration& calibration, const Manifest& manifest, ColmapNames names) {
  constexpr std::array<std::size_t, 2> kCounts{5, 8};
  if (manifest.source == "range") {
    return fail(ErrorCode::invalid_input, "scan {}: has range images only; export a scan of cameras", manifest.id);
  }
  CalibrationExport out;
  out.lens_model = "FULL_OPENCV";
  for (std::size_t side = 0; side < 2; ++side) out.lenses[side] = fit_lens(camera_of(calibration, side), kCounts);
  for (std::size_t pose = 0; pose < manifest.poses.size(); ++pose) {
    if (manifest.poses[pose].views.empty()) continue;
    const std::string folder = fmt::format("pose{}/", pose + 1);
    out.files.push_back({folder + "cameras.txt", colmap_cameras(calibration, out)});
    out.files.push_back({folder + "images.txt", colmap_images(calibration, manifest, pose, names)});
    out.files.push_back({folder + "points3D.txt",
                         "# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, "
                         "TRACK[] as (IMAGE_ID, POINT2D_IDX)\n# Number of points: 0, mean track length: 0\n"});
  }
  if (out.files.empty()) return fail(ErrorCode::invalid_input, "scan {}: has no views to export", manifest.id);
  return out;
}

}  // namespace scanrig
