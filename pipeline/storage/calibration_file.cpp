#include "pipeline/storage/calibration_file.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/files.h"

namespace scanrig {

Projection read_pinhole(JsonObject& object) {
  Projection projection;
  projection.width = object.integer("width", 16, 32768);
  projection.height = object.integer("height", 16, 32768);
  projection.fx = object.number("fx", 1.0, 1e6);
  projection.fy = object.number("fy", 1.0, 1e6);
  // A shifted principal point may lie outside the image, but not by more than its size.
  projection.cx = object.number("cx", -projection.width, 2.0 * projection.width);
  projection.cy = object.number("cy", -projection.height, 2.0 * projection.height);
  return projection;
}

namespace {

LensField read_lens_field(JsonObject object, const Projection& projection) {
  LensField field;
  field.width = projection.width;
  field.height = projection.height;
  const std::array<std::vector<double>, 2> parts{object.numbers("du"), object.numbers("dv")};
  for (int axis = 0; axis < 2; ++axis) {
    if (parts[axis].size() != field.shift.size()) {
      object.reject(axis == 0 ? "du" : "dv", "must be 42 numbers: 6 rows of 7 shifts in pixels");
      continue;
    }
    for (std::size_t i = 0; i < field.shift.size(); ++i) field.shift[i][axis] = parts[axis][i];
  }
  object.close();
  return field;
}

}  // namespace

namespace {

constexpr double kRounding = 1e-6;
constexpr int kCameraUnknowns = 30;  ///< of both cameras, see CalibrationQuality::cameras

/// Of correlations, for its rows differ by orders of magnitude; rounding may make a smallest eigenvalue of 0 negative.
bool is_covariance(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd scale =
      matrix.diagonal().unaryExpr([](double variance) { return variance > 0.0 ? 1.0 / std::sqrt(variance) : 0.0; });
  const Eigen::MatrixXd correlation = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation, Eigen::EigenvaluesOnly);
  return eigen.info() == Eigen::Success && eigen.eigenvalues().minCoeff() > -kRounding;
}

/// The lower triangle of a symmetric matrix, row after row.
Eigen::MatrixXd read_covariance(JsonObject& object, std::string_view key) {
  const std::vector<double> values = object.numbers(key);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(kCameraUnknowns, kCameraUnknowns);
  if (values.size() != kCameraUnknowns * (kCameraUnknowns + 1) / 2) {
    object.reject(key, "must be the 465 numbers of a lower triangle, 30 rows");
    return matrix;
  }
  std::size_t next = 0;
  for (int row = 0; row < kCameraUnknowns; ++row) {
    for (int column = 0; column <= row; ++column) matrix(row, column) = matrix(column, row) = values[next++];
    if (!(matrix(row, row) >= 0.0)) object.reject(key, "must have no negative variance");
  }
  if (!is_covariance(matrix)) object.reject(key, "must be a covariance: no combination has a negative variance");
  return matrix;
}

/// None: files of before have no offsets.
std::optional<BoardPrint> read_board_print(JsonObject object) {
  for (const char* key : {"columns", "rows", "square_mm", "thickness_mm", "markers", "length", "second_length"}) {
    object.ignore(key);
  }
  BoardPrint print;
  print.scale = object.number("scale", 0.5, 2.0);
  if (object.has("scale_sigma")) print.scale_sigma = object.number("scale_sigma", 0.0, 1.0);
  const std::vector<double> warp = object.numbers("warp_mm");
  if (warp.size() == print.warp_mm.size()) {
    std::copy(warp.begin(), warp.end(), print.warp_mm.begin());
  } else {
    object.reject("warp_mm", "must be three numbers");
  }
  const bool has_offsets = object.has("offsets_mm");
  if (has_offsets) {
    print.aspect = object.number("aspect", -0.1, 0.1);
    print.shear = object.number("shear", -0.1, 0.1);
    const std::vector<double> offsets = object.numbers("offsets_mm");
    if (offsets.size() % 3 != 0) object.reject("offsets_mm", "must be three numbers a corner");
    for (std::size_t i = 0; i + 2 < offsets.size(); i += 3) {
      print.offsets_mm.push_back({offsets[i], offsets[i + 1], offsets[i + 2]});
    }
  }
  object.close();
  return has_offsets ? std::optional(std::move(print)) : std::nullopt;
}

CalibrationQuality read_quality(JsonObject& root) {
  CalibrationQuality quality;
  quality.grade = root.one_of("grade", {"A", "B", "C"});
  JsonObject covariance = root.object("covariance");
  quality.volume_um = covariance.number("volume_um", 0.0, 1e6);
  quality.scale_um = covariance.number("scale_um", 0.0, 1e6);
  quality.cameras = read_covariance(covariance, "cameras");
  for (const char* part : {"axis_um", "strain_um", "azimuth_um", "base_um", "max_um"}) covariance.ignore(part);
  covariance.close();
  if (root.has("rim_dots")) {
    JsonObject dots = root.object("rim_dots");
    quality.rim_dot_diameter_mm = dots.number("diameter_mm", 0.1, 1e3);
    const std::vector<double> places = dots.numbers("places_mm");
    if (places.size() % 3 != 0) dots.reject("places_mm", "must be three numbers a dot");
    for (std::size_t i = 0; i + 2 < places.size(); i += 3) {
      quality.rim_dots.emplace_back(places[i], places[i + 1], places[i + 2]);
    }
    dots.close();
  }
  if (root.has("table")) {
    JsonObject table = root.object("table");
    quality.gear = table.number("gear", -10.0, 10.0);
    for (const char* key : {"angle_error_deg", "axis_from_square_deg"}) table.ignore(key);
    table.close();
  }
  if (root.has("board")) quality.board = read_board_print(root.object("board"));
  // What people and later calibrations read.
  for (const char* key :
       {"noise_px", "images", "cross_validation", "temperature_c", "sources", "previous", "sentences", "drift"}) {
    root.ignore(key);
  }
  return quality;
}

}  // namespace

Camera read_camera(JsonObject object) {
  Camera camera;
  camera.serial = object.text("serial");
  camera.projection = read_pinhole(object);
  const std::vector<double> distortion = object.numbers("distortion");
  if (distortion.size() == camera.distortion.size()) {
    std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  } else {
    object.reject("distortion", "must be five numbers: k1 k2 p1 p2 k3");
  }
  if (object.has("lens_correction")) {
    camera.lens_field = read_lens_field(object.object("lens_correction"), camera.projection);
  }
  camera.camera_from_turntable = object.transform("camera_from_turntable");
  if (camera.camera_from_turntable.translation().z() <= 0.0) {
    object.reject("camera_from_turntable", "puts the table behind the camera");
  }
  object.close();
  return camera;
}

Result<Calibration> read_calibration(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  return parse_calibration(*text, file);
}

Result<Calibration> parse_calibration(std::string_view text, const std::filesystem::path& file) {
  auto json = JsonFile::parse(text, file, "scanrig-calibration", 2, 1);
  if (!json) return pass_on(json);
  JsonObject& root = json->root();
  Calibration calibration;
  calibration.date = root.text("date");
  calibration.table_radius_mm = root.number("table_radius_mm", 1.0, 1e4);
  calibration.left = read_camera(root.object("left"));
  calibration.right = read_camera(root.object("right"));
  if (json->version() >= 2) {
    calibration.quality = read_quality(root);
  } else {
    root.ignore("report");
  }
  calibration.sha256 = json->sha256();
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  return calibration;
}

}  // namespace scanrig
