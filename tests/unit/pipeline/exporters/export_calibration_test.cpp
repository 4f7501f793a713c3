// What other programs make of the files: read by a parser and projected by a formula that are not the exporter's.
#include "pipeline/exporters/export_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/persistence.hpp>
#include <sstream>

namespace scanrig {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWidth = 1280, kHeight = 960;

Camera camera_at(double side, bool with_field) {
  Camera camera;
  camera.serial = side < 0.0 ? "L1" : "R2";
  camera.projection.width = kWidth;
  camera.projection.height = kHeight;
  camera.projection.fx = 4271.3 + 5.0 * side;
  camera.projection.fy = 4270.9;
  camera.projection.cx = 652.25;
  camera.projection.cy = 471.125;
  camera.distortion = {-0.11 + 0.01 * side, 0.34, 7e-4, -4e-4, 0.9};
  const Vector3d turn(0.35, 0.2 * side, 0.02 * side);
  camera.camera_from_turntable.linear() =
      (Eigen::AngleAxisd(turn.norm(), turn.normalized()) * Eigen::AngleAxisd(M_PI, Vector3d::UnitX())).matrix();
  camera.camera_from_turntable.translation() = Vector3d(-2.0 * side, 40.0, 480.0 + side);
  if (!with_field) return camera;
  LensField field;
  field.width = kWidth;
  field.height = kHeight;
  for (int i = 0; i < LensField::kCount; ++i) {
    field.shift[static_cast<std::size_t>(i)] = {0.12 * std::sin(1.3 * i + side), 0.1 * std::cos(0.7 * i * i)};
  }
  camera.lens_field = field;
  return camera;
}

Calibration calibration_with(bool with_field) {
  Calibration calibration;
  calibration.left = camera_at(-1.0, with_field);
  calibration.right = camera_at(1.0, with_field);
  calibration.table_radius_mm = 90.0;
  calibration.date = "2026-11-25T09:00:00Z";
  return calibration;
}

/// Points of the turntable frame all over the camera's image.
std::vector<Vector3d> points_of(const Camera& camera) {
  std::vector<Vector3d> points;
  for (int j = 0; j < 24; ++j) {
    for (int i = 0; i < 32; ++i) {
      const Vector2d pixel((i + 0.5) * (kWidth - 1) / 32.0, (j + 0.5) * (kHeight - 1) / 24.0);
      points.push_back(camera.camera_from_turntable.inverse() * (camera.ray(pixel) * (420.0 + 3.0 * i)));
    }
  }
  return points;
}

/// Root mean square and greatest distance of a projection from the camera's.
template <class Project>
std::array<double, 2> distance(const Camera& camera, const Project& project) {
  double sum = 0.0, greatest = 0.0;
  const auto points = points_of(camera);
  for (const Vector3d& point : points) {
    const double away = (project(point) - camera.project(point)).norm();
    sum += away * away;
    greatest = std::max(greatest, away);
  }
  return {std::sqrt(sum / static_cast<double>(points.size())), greatest};
}

/// All numbers of a text.
std::vector<double> numbers(std::string text) {
  for (char& c : text) {
    if (c == ',' || c == '[' || c == ']') c = ' ';
  }
  std::istringstream in(text);
  std::vector<double> found;
  for (double value = 0.0; in >> value;) found.push_back(value);
  return found;
}

/// A model file of mrcal: a Python dictionary with comments.
struct MrcalModel {
  std::string lensmodel;
  std::vector<double> intrinsics, extrinsics, imagersize;

  explicit MrcalModel(const std::string& text) {
    std::istringstream in(text);
    std::string code;
    for (std::string line; std::getline(in, line);) code += line.substr(0, line.find('#')) + "\n";
    const auto list = [&](const std::string& key) {
      const auto at = code.find("'" + key + "':");
      EXPECT_NE(at, std::string::npos) << key;
      const auto begin = code.find('[', at);
      return numbers(code.substr(begin, code.find(']', begin) - begin));
    };
    const auto name = code.find('\'', code.find("'lensmodel':") + 12) + 1;
    lensmodel = code.substr(name, code.find('\'', name) - name);
    intrinsics = list("intrinsics");
    extrinsics = list("extrinsics");
    imagersize = list("imagersize");
  }

  /// [mrcal, lens models: LENSMODEL_OPENCV]: OpenCV's polynomials; Rodrigues' formula.
  [[nodiscard]] Vector2d project(const Vector3d& point) const {
    const Vector3d r(extrinsics[0], extrinsics[1], extrinsics[2]), t(extrinsics[3], extrinsics[4], extrinsics[5]);
    const double angle = r.norm();
    const Vector3d axis = r / angle;
    const Vector3d p = std::cos(angle) * point + std::sin(angle) * axis.cross(point) +
                       (1.0 - std::cos(angle)) * axis.dot(point) * axis + t;
    std::vector<double> k(intrinsics.begin() + 4, intrinsics.end());
    k.resize(12, 0.0);
    const double x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
    const double cdist = 1 + k[0] * r2 + k[1] * r4 + k[4] * r6;
    const double icdist2 = 1. / (1 + k[5] * r2 + k[6] * r4 + k[7] * r6);
    const double xd = x * cdist * icdist2 + k[2] * (2 * x * y) + k[3] * (r2 + 2 * x * x) + k[8] * r2 + k[9] * r4;
    const double yd = y * cdist * icdist2 + k[2] * (r2 + 2 * y * y) + k[3] * (2 * x * y) + k[10] * r2 + k[11] * r4;
    return {xd * intrinsics[0] + intrinsics[2], yd * intrinsics[1] + intrinsics[3]};
  }
};

/// "... 0.0123 px rms over the image, 0.0456 px at most" of a comment for this side.
std::array<double, 2> stated(const std::string& text, const std::string& side) {
  const auto line = text.find(side + " camera: ");
  EXPECT_NE(line, std::string::npos) << text.substr(0, 400);
  const auto rms = text.find("lens field: ", line), greatest = text.find("image, ", line);
  if (rms == std::string::npos || greatest == std::string::npos) return {};
  return {std::stod(text.substr(rms + 12)), std::stod(text.substr(greatest + 7))};
}

void expect_as_stated(const std::array<double, 2>& found, const std::array<double, 2>& stated) {
  EXPECT_GT(stated[0], 0.001);
  EXPECT_NEAR(found[0], stated[0], 0.15 * stated[0]);
  EXPECT_LE(found[1], 1.02 * stated[1]);
}

TEST(ExportMrcal, ProjectsAsTheCamera) {
  const Calibration calibration = calibration_with(false);
  const auto made = export_mrcal(calibration);
  ASSERT_EQ(made.files.size(), 2u);
  EXPECT_EQ(made.files[0].path, "left.cameramodel");
  EXPECT_EQ(made.files[1].path, "right.cameramodel");
  for (std::size_t side = 0; side < 2; ++side) {
    const MrcalModel model(made.files[side].text);
    EXPECT_EQ(model.lensmodel, "LENSMODEL_OPENCV5");
    EXPECT_EQ(model.intrinsics.size(), 9u);
    EXPECT_EQ(model.imagersize, (std::vector<double>{kWidth, kHeight}));
    const Camera& camera = side == 0 ? calibration.left : calibration.right;
    EXPECT_LT(distance(camera, [&](const Vector3d& p) { return model.project(p); })[1], 1e-6);
    EXPECT_TRUE(what_is_lost(made, side).empty());
  }
}

TEST(ExportMrcal, KeepsOddNamesInTheComment) {
  Calibration calibration = calibration_with(false);
  calibration.left.serial = "L\n'lensmodel': 'X'\n";
  EXPECT_EQ(MrcalModel(export_mrcal(calibration).files[0].text).lensmodel, "LENSMODEL_OPENCV5");
}

TEST(ExportMrcal, OfALensFieldIsAsNearAsItStates) {
  const Calibration calibration = calibration_with(true);
  const auto made = export_mrcal(calibration);
  for (std::size_t side = 0; side < 2; ++side) {
    const Camera& camera = side == 0 ? calibration.left : calibration.right;
    const MrcalModel model(made.files[side].text);
    EXPECT_EQ(model.lensmodel, "LENSMODEL_OPENCV" + std::to_string(model.intrinsics.size() - 4));
    const auto found = distance(camera, [&](const Vector3d& p) { return model.project(p); });
    expect_as_stated(found, stated(made.files[side].text, side == 0 ? "left" : "right"));
    // Better than the same camera with its field cut off.
    Camera plain = camera;
    plain.lens_field.reset();
    EXPECT_LT(found[0], 0.95 * distance(camera, [&](const Vector3d& p) { return plain.project(p); })[0]);
  }
}

/// Projects by cv::projectPoints() what cv::FileStorage reads.
struct OpenCvRig {
  cv::Mat k[2], d[2], r, t, turntable_from_left;
  int width = 0, height = 0;

  explicit OpenCvRig(const std::string& text) {
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    EXPECT_TRUE(file.isOpened());
    file["K1"] >> k[0];
    file["K2"] >> k[1];
    file["D1"] >> d[0];
    file["D2"] >> d[1];
    file["R"] >> r;
    file["T"] >> t;
    file["turntable_from_left"] >> turntable_from_left;
    file["image_width"] >> width;
    file["image_height"] >> height;
  }

  [[nodiscard]] Vector2d project(int side, const Vector3d& in_turntable) const {
    const cv::Mat point = (cv::Mat_<double>(4, 1) << in_turntable.x(), in_turntable.y(), in_turntable.z(), 1.0);
    cv::Mat in_camera = cv::Mat(turntable_from_left.inv() * point).rowRange(0, 3);
    if (side == 1) in_camera = r * in_camera + t;
    std::vector<cv::Point2d> pixels;
    const std::vector<cv::Point3d> points{{in_camera.at<double>(0), in_camera.at<double>(1), in_camera.at<double>(2)}};
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), k[side], d[side], pixels);
    return {pixels[0].x, pixels[0].y};
  }
};

TEST(ExportOpenCv, ProjectsAsTheCamera) {
  const Calibration calibration = calibration_with(false);
  const auto made = export_opencv(calibration);
  const OpenCvRig rig(made.files.at(0).text);
  EXPECT_EQ(rig.width, kWidth);
  EXPECT_EQ(rig.height, kHeight);
  EXPECT_EQ(rig.d[0].total(), 5u);
  EXPECT_LT(distance(calibration.left, [&](const Vector3d& p) { return rig.project(0, p); })[1], 1e-6);
  EXPECT_LT(distance(calibration.right, [&](const Vector3d& p) { return rig.project(1, p); })[1], 1e-6);
}

TEST(ExportOpenCv, OfALensFieldIsAsNearAsItStates) {
  const Calibration calibration = calibration_with(true);
  const auto made = export_opencv(calibration);
  const OpenCvRig rig(made.files.at(0).text);
  EXPECT_GT(rig.d[0].total(), 5u);
  expect_as_stated(distance(calibration.left, [&](const Vector3d& p) { return rig.project(0, p); }),
                   stated(made.files[0].text, "left"));
  expect_as_stated(distance(calibration.right, [&](const Vector3d& p) { return rig.project(1, p); }),
                   stated(made.files[0].text, "right"));
}

TEST(LensFit, HoldsATiltedSensorAsOpenCvDoes) {
  OpenCvLens lens{.fx = 900.0, .fy = 910.0, .cx = 600.0, .cy = 500.0};
  lens.distortion = {-0.2, 0.1, 1e-3, -2e-3, 0.05, 0.02, -0.01, 0.03, 1e-3, -2e-3, 3e-3, 1e-3, 0.02, -0.03};
  const Vector3d point(0.3, -0.2, 1.1);
  const cv::Matx33d k(lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0);
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(), k,
                    std::vector<double>(lens.distortion.begin(), lens.distortion.end()), pixels);
  EXPECT_LT((lens.project(point) - Vector2d(pixels[0].x, pixels[0].y)).norm(), 1e-9);
}

Manifest scan_of_two_views() {
  Manifest manifest;
  manifest.id = "test";
  PoseRecord pose{.name = "pose1", .complete = true, .views = {}};
  for (int v = 0; v < 2; ++v) {
    ViewRecord view;
    view.index = v;
    view.measured_deg = 40.0 * v + 0.25;
    for (const char* side : {"left", "right"}) {
      view.files[std::string(side) + "_plain"] = {"pose1/view0" + std::to_string(v) + "/" + side + "_plain.png", ""};
    }
    pose.views.push_back(view);
  }
  manifest.poses = {pose, {.name = "pose2", .complete = false, .views = {}}};
  return manifest;
}

std::string text_of(const CalibrationExport& made, const std::string& path) {
  for (const ExportedFile& file : made.files) {
    if (file.path == path) return file.text;
  }
  ADD_FAILURE() << path << " is missing";
  return "";
}

/// The lines of a COLMAP file without its comments; images.txt has an empty one after each image.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("#")) lines.push_back(line);
  }
  return lines;
}

/// A pinhole camera's FULL_OPENCV [COLMAP, camera models], in COLMAP's pixels.
struct ColmapCamera {
  std::string model;
  std::vector<double> size_and_parameters;

  [[nodiscard]] Vector2d project(const Vector3d& in_camera) const {
    const auto p = std::span(size_and_parameters).subspan(2);
    const double u = in_camera.x() / in_camera.z(), v = in_camera.y() / in_camera.z();
    const double u2 = u * u, uv = u * v, v2 = v * v, r2 = u2 + v2;
    const double radial = (1 + p[4] * r2 + p[5] * r2 * r2 + p[8] * r2 * r2 * r2) /
                          (1 + p[9] * r2 + p[10] * r2 * r2 + p[11] * r2 * r2 * r2);
    return {p[0] * (u * radial + 2 * p[6] * uv + p[7] * (r2 + 2 * u2)) + p[2],
            p[1] * (v * radial + 2 * p[7] * uv + p[6] * (r2 + 2 * v2)) + p[3]};
  }
};

ColmapCamera colmap_camera(const std::string& line) {
  std::istringstream in(line);
  ColmapCamera camera;
  int id = 0;
  in >> id >> camera.model;
  std::string rest;
  std::getline(in, rest);
  camera.size_and_parameters = numbers(rest);
  return camera;
}

TEST(ExportColmap, ProjectsThePartOfEveryViewAsTheCameras) {
  const Calibration calibration = calibration_with(false);
  const auto made = export_colmap(calibration, scan_of_two_views(), ColmapNames::of_scan);
  ASSERT_TRUE(made) << made.error().message;
  const auto cameras = lines_of(text_of(*made, "pose1/cameras.txt"));
  ASSERT_EQ(cameras.size(), 2u);
  const auto images = lines_of(text_of(*made, "pose1/images.txt"));
  ASSERT_EQ(images.size(), 8u);
  EXPECT_TRUE(lines_of(text_of(*made, "pose1/points3D.txt")).empty());
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(images[2 * i + 1].empty());
    std::istringstream in(images[2 * i]);
    double id = 0, qw = 0, qx = 0, qy = 0, qz = 0, tx = 0, ty = 0, tz = 0;
    std::size_t camera_id = 0;
    std::string name;
    in >> id >> qw >> qx >> qy >> qz >> tx >> ty >> tz >> camera_id >> name;
    EXPECT_EQ(name,
              std::string("pose1/view0") + (i < 2 ? "0" : "1") + (i % 2 == 0 ? "/left" : "/right") + "_plain.png");
    ASSERT_EQ(camera_id, i % 2 + 1);
    const ColmapCamera colmap = colmap_camera(cameras[camera_id - 1]);
    EXPECT_EQ(colmap.model, "FULL_OPENCV");
    EXPECT_EQ(colmap.size_and_parameters.size(), 14u);
    const Camera& camera = i % 2 == 0 ? calibration.left : calibration.right;
    const double theta = (i < 2 ? 0.25 : 40.25) * M_PI / 180.0;
    for (const Vector3d& turned : points_of(camera)) {
      // The point of the part that the table has carried to `turned`.
      const Vector3d part(std::cos(theta) * turned.x() - std::sin(theta) * turned.z(), turned.y(),
                          std::sin(theta) * turned.x() + std::cos(theta) * turned.z());
      const Vector3d q(qx, qy, qz);
      const Vector3d in_camera = part + 2.0 * q.cross(q.cross(part) + qw * part) + Vector3d(tx, ty, tz);
      // COLMAP has the centre of the first pixel at (0.5, 0.5).
      ASSERT_LT((colmap.project(in_camera) - Vector2d(0.5, 0.5) - camera.project(turned)).norm(), 1e-6);
    }
  }
}

TEST(ExportColmap, HasTheImagesMiddleAtHalfItsSize) {
  Calibration calibration = calibration_with(false);
  calibration.left.projection.cx = 0.5 * (kWidth - 1);
  calibration.left.projection.cy = 0.5 * (kHeight - 1);
  const auto made = export_colmap(calibration, scan_of_two_views(), ColmapNames::of_scan);
  const auto parameters = colmap_camera(lines_of(text_of(*made, "pose1/cameras.txt"))[0]).size_and_parameters;
  EXPECT_EQ(parameters[4], kWidth / 2.0);
  EXPECT_EQ(parameters[5], kHeight / 2.0);
}

TEST(ExportColmap, OfALensFieldIsAsNearAsItStates) {
  const Calibration calibration = calibration_with(true);
  const auto made = export_colmap(calibration, scan_of_two_views(), ColmapNames::of_copy);
  ASSERT_TRUE(made);
  const std::string text = text_of(*made, "pose1/cameras.txt");
  const ColmapCamera colmap = colmap_camera(lines_of(text)[0]);
  expect_as_stated(
      distance(calibration.left,
               [&](const Vector3d& p) {
                 return Vector2d(colmap.project(calibration.left.camera_from_turntable * p) - Vector2d(0.5, 0.5));
               }),
      stated(text, "left"));
  EXPECT_NE(text_of(*made, "pose1/images.txt").find(" 2 pose1/view01_right.png\n"), std::string::npos);
}

TEST(ExportColmap, NeedsViewsOfCameras) {
  Manifest manifest;
  manifest.id = "empty";
  EXPECT_EQ(export_colmap(calibration_with(false), manifest, ColmapNames::of_scan).error().code,
            ErrorCode::invalid_input);
  manifest = scan_of_two_views();
  manifest.source = "range";
  EXPECT_EQ(export_colmap(calibration_with(false), manifest, ColmapNames::of_scan).error().code,
            ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
