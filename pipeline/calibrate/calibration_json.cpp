#include "pipeline/calibrate/calibration_json.h"

#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/storage/transform_json.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr Eigen::Index kWithoutField = 15;  ///< unknowns of a camera in the file

ordered_json to_json(const Camera& camera) {
  const Projection& p = camera.projection;
  ordered_json json{{"serial", camera.serial},
                    {"width", p.width},
                    {"height", p.height},
                    {"fx", p.fx},
                    {"fy", p.fy},
                    {"cx", p.cx},
                    {"cy", p.cy},
                    {"distortion", camera.distortion}};
  if (camera.lens_field) {
    ordered_json du = ordered_json::array(), dv = ordered_json::array();
    for (const Eigen::Vector2d& shift : camera.lens_field->shift) {
      du.push_back(shift.x());
      dv.push_back(shift.y());
    }
    json["lens_correction"] = {{"du", du}, {"dv", dv}};
  }
  json["camera_from_turntable"] = transform_json(camera.camera_from_turntable);
  return json;
}

/// Lower triangle of the covariance of both cameras' lenses and poses, row after row.
ordered_json camera_covariance(const SolvedCalibration& solved) {
  const Eigen::Index stride = solved.camera_covariance.rows() / 2;
  const auto at = [&](Eigen::Index i) { return i < kWithoutField ? i : stride + i - kWithoutField; };
  ordered_json values = ordered_json::array();
  for (Eigen::Index row = 0; row < 2 * kWithoutField; ++row) {
    for (Eigen::Index column = 0; column <= row; ++column) {
      values.push_back(solved.camera_covariance(at(row), at(column)));
    }
  }
  return values;
}

ordered_json covariance(const SolvedCalibration& solved) {
  const VolumeSigma& s = *solved.sigma;
  return {
      {"volume_um", s.volume}, {"axis_um", s.axis},   {"strain_um", s.strain}, {"azimuth_um", s.azimuth},
      {"max_um", s.max},       {"scale_um", s.scale}, {"base_um", s.base},     {"cameras", camera_covariance(solved)}};
}

ordered_json images(const SolvedCalibration& solved) {
  ordered_json all = ordered_json::array();
  for (const ImageFit& image : solved.images) {
    ordered_json json{{"name", image.name},           {"camera", image.camera == 0 ? "left" : "right"},
                      {"placement", image.placement}, {"corners", image.corners},
                      {"used", image.is_used},        {"mean_px", {image.mean_px.x(), image.mean_px.y()}},
                      {"rms_px", image.rms_px},       {"blur_px", image.blur_px}};
    if (!image.is_used) json["left_out_because"] = image.left_out_because;
    all.push_back(std::move(json));
  }
  return all;
}

ordered_json to_json(const std::optional<MeasuredLength>& length) {
  if (!length) return nullptr;
  return {{"nominal_mm", length->nominal_mm}, {"measured_mm", length->measured_mm}, {"sigma_mm", length->sigma_mm}};
}

ordered_json board(const CalibrationInput& input, const SolvedCalibration& solved) {
  const Board& b = input.board;
  ordered_json json{
      {"columns", b.columns}, {"rows", b.rows}, {"square_mm", b.square_mm}, {"thickness_mm", b.thickness_mm}};
  if (b.markers) json["markers"] = {{"size_mm", b.markers->size_mm}, {"dictionary", b.markers->dictionary}};
  json["length"] = to_json(input.length);
  json["second_length"] = to_json(input.second_length);
  json["scale"] = solved.board.scale;
  json["scale_sigma"] = solved.board.scale_sigma;
  json["aspect"] = solved.board.aspect;
  json["shear"] = solved.board.shear;
  json["warp_mm"] = solved.board.warp_mm;
  ordered_json offsets = ordered_json::array();
  for (const auto& corner : solved.board.offsets_mm) {
    for (const double value : corner) offsets.push_back(std::round(1e7 * value) / 1e7);
  }
  json["offsets_mm"] = std::move(offsets);
  return json;
}

ordered_json table(const SolvedCalibration& solved) {
  ordered_json json{{"gear", solved.table.gear}, {"angle_error_deg", solved.table.angle_error_deg}};
  if (solved.table.axis_from_square_deg) json["axis_from_square_deg"] = *solved.table.axis_from_square_deg;
  return json;
}

void add_rim_dots(ordered_json& json, const CalibrationInput& input, const SolvedCalibration& solved) {
  if (solved.table.dots.empty()) return;
  ordered_json places = ordered_json::array();
  for (const Eigen::Vector3d& dot : solved.table.dots) {
    for (const double value : {dot.x(), dot.y(), dot.z()}) places.push_back(value);
  }
  json["rim_dots"] = {{"diameter_mm", input.rim_dots.diameter_mm}, {"places_mm", places}};
}

void add_judgement(ordered_json& json, const CalibrationJudgement& judgement) {
  if (const auto& ab = judgement.cross_validation) {
    json["cross_validation"] = {{"difference_um", ab->difference}, {"max_um", ab->max}, {"expected_um", ab->expected}};
  }
  json["sentences"] = judgement.sentences;
}

}  // namespace

Result<std::string> calibration_json(const FolderCalibration& outcome, const CalibrationOrigin& origin) {
  const SolvedCalibration& solved = outcome.judged.solved;
  const CalibrationJudgement& judgement = outcome.judged.judgement;
  if (judgement.grade == CalibrationGrade::refused || !solved.sigma) {
    const std::string reason =
        solved.sigma ? fmt::format("{:.0f} um of uncertainty in the working volume, 40 at most", judgement.graded_um)
                     : "no volume to grade";
    return fail(ErrorCode::below_limits, "calibration: refused: {}",
                judgement.sentences.empty() ? reason : fmt::format("{}", fmt::join(judgement.sentences, " ")));
  }
  ordered_json json{{"format", "scanrig-calibration"},
                    {"version", 2},
                    {"date", origin.date},
                    {"grade", to_string(judgement.grade)},
                    {"table_radius_mm", outcome.input.table_radius_mm},
                    {"left", to_json(solved.calibration.left)},
                    {"right", to_json(solved.calibration.right)}};
  add_rim_dots(json, outcome.input, solved);
  json["covariance"] = covariance(solved);
  json["noise_px"] = solved.noise_px;
  add_judgement(json, judgement);
  json["board"] = board(outcome.input, solved);
  json["table"] = table(solved);
  json["images"] = images(solved);
  if (origin.temperature_c) json["temperature_c"] = *origin.temperature_c;
  for (const auto& [file, hash] : origin.sources) json["sources"].push_back({{"path", file}, {"sha256", hash}});
  if (!origin.previous.empty()) json["previous"] = origin.previous;
  return json.dump(1) + "\n";
}

Result<std::string> moved_calibration_json(std::string_view known, const DriftCheck& check,
                                           const CalibrationOrigin& origin) {
  auto json = ordered_json::parse(known, nullptr, false);
  if (!json.is_object() || !json.contains("covariance")) {
    return fail(ErrorCode::invalid_input, "calibration: the file to replace is not of version 2; calibrate the rig");
  }
  json["date"] = origin.date;
  for (const auto& [side, camera] : {std::pair("left", &check.calibration.left), {"right", &check.calibration.right}}) {
    json[side]["camera_from_turntable"] = transform_json(camera->camera_from_turntable);
  }
  auto& volume = json["covariance"]["volume_um"];
  volume = std::hypot(volume.get<double>(), check.sigma_um);
  json["drift"] = {{"difference_um", check.difference_um},
                   {"sigma_um", check.sigma_um},
                   {"cameras_px", {check.cameras_px.x(), check.cameras_px.y()}},
                   {"axis_mm", check.axis_mm},
                   {"axis_deg", check.axis_deg}};
  json["sentences"] = check.sentences;
  json["sources"] = ordered_json::array();
  for (const auto& [file, hash] : origin.sources) json["sources"].push_back({{"path", file}, {"sha256", hash}});
  json["previous"] = origin.previous;
  return json.dump(1) + "\n";
}

}  // namespace scanrig
