#include "pipeline/reconstruct/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "core/units.h"
#include "core/version.h"
#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/reconstruct/pose_sentences.h"
#include "pipeline/registration/pose_uncertainty.h"

namespace scanrig {
namespace {

using nlohmann::json;

/// JSON has no NaN: unknown values are null.
json number(double value) { return std::isfinite(value) ? json(value) : json(); }

json vector_json(const Eigen::Vector3d& v) { return {number(v.x()), number(v.y()), number(v.z())}; }

json transform_json(const Transform& transform) {
  json rotation = json::array();
  for (int row = 0; row < 3; ++row) {
    rotation.push_back(vector_json(Eigen::Vector3d(transform.linear().row(row).transpose())));
  }
  return {{"rotation", rotation}, {"translation", vector_json(transform.translation())}};
}

json view_json(const View& view, const ViewFit& fit) {
  const cv::Mat1f& depth = view.range.depth;
  const auto measured = static_cast<double>(cv::countNonZero(depth == depth));  // NaN differs from itself
  const Projection& image = view.range.projection;
  const bool is_cropped = image.is_cropped();
  const double pixels =
      1.0 * (is_cropped ? image.sensor_width : image.width) * (is_cropped ? image.sensor_height : image.height);
  return {{"index", fit.index},
          {"measured_share_of_image", measured / pixels},
          {"angle_correction_deg", number(fit.angle_correction_deg)},
          {"rotation_correction_deg", vector_json(fit.rotation_deg)},
          {"translation_correction_mm", vector_json(fit.translation_mm)},
          {"residual_median_before_mm", number(fit.median_before_mm)},
          {"residual_median_mm", number(fit.median_after_mm)},
          {"residual_rms_mm", number(fit.rms_after_mm)},
          {"overlap", number(fit.overlap)}};
}

json watch_json(const RigWatch& rig) {
  const Watch& watch = rig.result();
  json parts = json::array();
  for (const WatchedPart& part : watch.parts) {
    parts.push_back({{"part", to_string(part.part)},
                     {"verdict", to_string(part.verdict)},
                     {"px", number(part.px)},
                     {"volume_um", number(part.volume_um)},
                     {"expected_px", number(part.expected_px)}});
  }
  json result = {{"verdict", to_string(watch.verdict)},
                 {"parts", parts},
                 {"sentences", watch.sentences},
                 {"dots", watch.dots},
                 {"rows", watch.rows},
                 {"rows_rms_px", number(watch.rows_rms_px)},
                 {"table_zero_deg", number(watch.table_zero_deg)},
                 {"refined", json()}};
  if (rig.is_refined()) {
    json angles = json::array();
    for (const double angle : watch.refined_angles_rad) angles.push_back(to_degrees(angle));
    const auto camera = [](const Camera& c) {
      return json{{"camera_from_turntable", transform_json(c.camera_from_turntable)}};
    };
    result["refined"] = {
        {"left", camera(rig.calibration().left)}, {"right", camera(rig.calibration().right)}, {"angles_deg", angles}};
  }
  return result;
}

json volume_json(const VolumeReport& volume) {
  constexpr std::array<const char*, kVoxelClasses> kNames = {"overlap", "nonoverlap", "inside", "outside", "unseen"};
  json classes = json::array();
  for (const auto& pose : volume.class_counts) {
    json counts;
    for (std::size_t c = 0; c < kVoxelClasses; ++c) counts[kNames[c]] = pose[c];
    classes.push_back(counts);
  }
  json pairs;
  for (std::size_t a = 0; a < kVoxelClasses; ++a) {
    for (std::size_t b = 0; b < kVoxelClasses; ++b) {
      if (volume.class_pairs[a][b] > 0) pairs[fmt::format("{}/{}", kNames[a], kNames[b])] = volume.class_pairs[a][b];
    }
  }
  return {{"band_mm", volume.band_mm},
          {"active_voxels", volume.active_voxels},
          {"dropped_components", volume.dropped_components},
          {"genus_before_repair", volume.genus_before_repair},
          {"voxels_cut", volume.voxels_cut},
          {"voxels_filled", volume.voxels_filled},
          {"classes", classes},
          {"class_pairs", pairs},
          {"conflicts", volume.conflicts}};
}

double face_area(const Mesh& mesh, const Mesh::Face& face) {
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  const Eigen::Vector3d b = mesh.vertices[face[1]].cast<double>();
  const Eigen::Vector3d c = mesh.vertices[face[2]].cast<double>();
  return 0.5 * (b - a).cross(c - a).norm();
}

json candidate_json(const Candidate& candidate) {
  return {{"pose1_from_pose2", transform_json(candidate.pose1_from_pose2)},
          {"generator", candidate.generator},
          {"rest_normal_in_pose1", vector_json(candidate.normal1)},
          {"rest_normal_in_pose2", vector_json(candidate.normal2)},
          {"confirmed", candidate.agreement.confirmed},
          {"contradicted", candidate.agreement.contradicted},
          {"in_free_space", candidate.agreement.free_space},
          {"median_mm", number(candidate.agreement.median_mm)},
          {"angle_to_best_deg", candidate.angle_to_best_deg},
          {"contradicted_more_than_best", candidate.contradicted_more},
          {"separable", candidate.separable}};
}

json counts_json(const RestCounts& counts) {
  return {{"tangent_planes", counts.tangent_planes},
          {"after_base_plane", counts.after_base_plane},
          {"after_stability", counts.after_stability},
          {"after_height", counts.after_height}};
}

json mesh_json(const Mesh& mesh) {
  const Topology shape = topology(mesh);
  double area = 0.0, measured = 0.0;
  for (const Mesh::Face& face : mesh.faces) {
    const double here = face_area(mesh, face);
    area += here;
    if (mesh.views[face[0]] > 0 && mesh.views[face[1]] > 0 && mesh.views[face[2]] > 0) measured += here;
  }
  json result = {{"vertices", mesh.vertices.size()},
                 {"faces", mesh.faces.size()},
                 {"components", shape.components},
                 {"watertight", shape.watertight()},
                 {"genus", shape.genus()},
                 {"area_mm2", area},
                 {"measured_share", measured / area},
                 {"closed_share", 1.0 - measured / area}};
  if (const auto solid = solid_properties(mesh)) {
    result["volume_mm3"] = solid->volume_mm3;
    result["centre_of_mass"] = vector_json(solid->centre_of_mass);
  }
  return result;
}

json symmetry_json(const Symmetry& symmetry) {
  const bool has_axis = symmetry.axis.norm() > 0.5;
  const bool has_point = has_axis || symmetry.group == Symmetry::Group::spherical;
  return {{"group", to_string(symmetry.group)},
          {"of", to_string(symmetry.of)},
          {"fold", symmetry.is_continuous() ? json() : json(symmetry.fold)},
          {"two_sided", symmetry.two_sided},
          {"axis", has_axis ? vector_json(symmetry.axis) : json()},
          {"point", has_point ? vector_json(symmetry.point) : json()},
          {"motions", symmetry.motions == 0 ? json() : json(symmetry.motions)}};
}

json estimate_json(const PoseEstimate& estimate) {
  json alternatives = json::array();
  for (const Candidate& candidate : estimate.alternatives) alternatives.push_back(candidate_json(candidate));
  return {{"pose1_from_pose2", transform_json(estimate.pose1_from_pose2)},
          {"chosen", candidate_json(estimate.best)},
          {"alternatives", alternatives},
          {"tangent_planes", {counts_json(estimate.counts1), counts_json(estimate.counts2)}},
          {"pairs", estimate.pairs},
          {"hypotheses", estimate.hypotheses},
          {"refined", estimate.refined},
          {"overlap", estimate.overlap},
          {"condition", number(estimate.condition)},
          {"symmetry", symmetry_json(estimate.symmetry)}};
}

/// `poses` from 0.
json pair_json(const PosePair& pair) {
  const bool is_placed = pair.pose1_from_pose2.has_value();
  return {{"poses", {pair.pose1, pair.pose2}},
          {"verdict", to_string(pair.verdict)},
          {"confirmed", is_placed ? json(pair.judged.confirmed) : json()},
          {"contradicted", is_placed ? json(pair.judged.contradicted) : json()},
          {"residual_median_mm", json()},
          {"overlap", json()},
          {"estimate", pair.estimate ? estimate_json(*pair.estimate) : json()},
          {"message", pair.message.empty() ? json() : json(pair.message)}};
}

/// Of three coordinates: standard deviations, the weakest first, and its direction.
json sigma_json(const Eigen::Matrix3d& covariance, double unit) {
  const PrincipalSigmas found = principal_sigmas(covariance);
  const Eigen::Vector3d weakest = found.directions.col(0);
  return {{"sigma", {found.sigma[0] * unit, found.sigma[1] * unit, found.sigma[2] * unit}},
          {"weakest", {weakest.x(), weakest.y(), weakest.z()}}};
}

json uncertainty_json(const Eigen::Vector3d& centre, const Eigen::Matrix<double, 6, 6>& covariance) {
  json rows = json::array();
  for (const double value : covariance.reshaped()) rows.push_back(value);
  return {{"centre_mm", {centre.x(), centre.y(), centre.z()}},
          {"rotation_deg", sigma_json(covariance.topLeftCorner<3, 3>(), to_degrees(1.0))},
          {"translation_mm", sigma_json(covariance.bottomRightCorner<3, 3>(), 1.0)},
          {"covariance", rows}};
}

/// Null without one.
json sentence_json(const std::string& sentence) { return sentence.empty() ? json() : json(sentence); }

}  // namespace

Report::Report(const ReconstructOptions& options, const std::optional<Calibration>& calibration)
    : json_(std::make_unique<json>()) {
  json& report = *json_;
  report["format"] = "scanrig-report";
  report["version"] = 2;
  report["software"] = {{"name", "scanrig"}, {"version", kVersion}, {"compiler", kCompiler}};
  report["calibration_sha256"] = calibration ? calibration->sha256 : "";
  report["options"] = {{"voxel_mm", options.voxel_mm}, {"fusion", options.fusion}, {"rests", options.rests},
                       {"texture", options.texture},   {"watch", options.watch},   {"threads", options.threads},
                       {"fixture", options.fixture}};
  report["poses"] = json::array();
  report["fixtures"] = json::array();
}

void Report::add_identity(const ScanIdentity& identity) {
  json& report = *json_;
  report["scan"] = identity.id;
  report["profile_sha256"] = identity.profile;
  report["config_sha256"] = identity.config_sha256;
}

Report::~Report() = default;
Report::Report(const Report& other) : json_(std::make_unique<json>(*other.json_)) {}
Report::Report(Report&&) noexcept = default;
Report& Report::operator=(Report&&) noexcept = default;

void Report::add_pose(std::span<const View> views, const RegistrationReport& registration, const VolumeReport& partial,
                      const RigWatch* watch) {
  json per_view = json::array();
  for (std::size_t v = 0; v < views.size(); ++v) per_view.push_back(view_json(views[v], registration.views[v]));
  (*json_)["poses"].push_back({{"views", per_view},
                               {"residual_median_before_mm", number(registration.median_before_mm)},
                               {"residual_median_mm", number(registration.median_after_mm)},
                               {"axis_tilt_correction_deg", registration.axis_tilt_deg},
                               {"axis_shift_correction_mm", registration.axis_shift_mm},
                               {"angle_observable", registration.angle_observable},
                               {"watch", watch ? watch_json(*watch) : json()},
                               {"partial_model", volume_json(partial)}});
}

void Report::add_estimate(const PoseEstimate& estimate) {
  (*json_)["pose_estimate"] = estimate_json(estimate);
  if (estimate.is_picked) (*json_)["pose_estimate"]["picked"] = true;
}

void Report::add_turn(const PoseEstimate& estimate, const ColourDecision* colours) {
  json turn = {{"decided_by", "nothing"},
               {"turned_over_is_assumed", estimate.turned_over_is_assumed},
               {"sentence", turn_sentence(estimate, colours)},
               {"colours", json()}};
  if (colours != nullptr) {
    if (colours->is_decided) {
      turn["decided_by"] = "colours";
      turn["turned_over_is_assumed"] = false;
    }
    turn["colours"] = {{"correlation", number(colours->correlation)},
                       {"next_correlation", number(colours->next)},
                       {"confidence_sigma", number(colours->confidence)},
                       {"contrast", number(colours->contrast)}};
  }
  (*json_)["pose_estimate"]["turn"] = turn;
}

void Report::add_refinement(const RefinedPose& refined, bool is_turn_open) {
  (*json_)["pose1_from_pose2"] = transform_json(refined.pose1_from_pose2);
  (*json_)["pose_refinement"] = {{"residual_median_mm", number(refined.median_mm)},
                                 {"residual_rms_mm", number(refined.rms_mm)},
                                 {"overlap", refined.overlap},
                                 {"correspondences", refined.correspondences},
                                 {"condition", number(refined.condition)},
                                 {"uncertainty", uncertainty_json(refined.centre, refined.covariance)},
                                 {"turn_is_open", is_turn_open},
                                 {"sentence", sentence_json(weakness_sentence(1, refined.covariance, is_turn_open))}};
}

void Report::add_placed(const PlacedPoses& placed, std::span<const std::size_t> kept, std::span<const PoseLink> links,
                        const RefinedPoses& refined, bool layers) {
  json of_poses = json::array(), pairs = json::array(), left_out = json::array();
  const bool is_turn_open = std::ranges::any_of(links, [](const PoseLink& link) { return !link.held.empty(); });
  for (std::size_t i = 1; i < kept.size(); ++i) {
    (*json_)[fmt::format("pose{}_from_pose{}", kept[0] + 1, kept[i] + 1)] = transform_json(refined.model_from_pose[i]);
    of_poses.push_back({{"pose", kept[i]},
                        {"uncertainty", uncertainty_json(refined.centre, refined.covariance[i])},
                        {"sentence", sentence_json(weakness_sentence(kept[i], refined.covariance[i], is_turn_open))}});
  }
  for (const PosePair& pair : placed.pairs) pairs.push_back(pair_json(pair));
  for (std::size_t i = 0; i < links.size(); ++i) {
    const auto is_its = [&](const json& pair) {
      return pair["poses"][0] == kept[links[i].pose1] && pair["poses"][1] == kept[links[i].pose2];
    };
    json& pair = *std::find_if(pairs.begin(), pairs.end(), is_its);
    pair["residual_median_mm"] = number(refined.links[i].median_mm);
    pair["overlap"] = refined.links[i].overlap;
  }
  for (const LeftOutPose& pose : placed.left_out) {
    left_out.push_back({{"pose", pose.pose}, {"sentence", pose.sentence}});
  }
  (*json_)["pose_graph"] = {{"frame_of_pose", kept[0]}, {"poses", std::vector<std::size_t>(kept.begin(), kept.end())},
                            {"pairs", pairs},           {"searches", placed.searches},
                            {"left_out", left_out},     {"colours_of_one_pose_each", layers}};
  (*json_)["pose_refinement"] = {{"residual_median_mm", number(refined.median_mm)},
                                 {"residual_rms_mm", number(refined.rms_mm)},
                                 {"turn_is_open", is_turn_open},
                                 {"poses", of_poses}};
}

void Report::add_fixtures(std::span<const std::optional<Fixture>> of_pose) {
  for (std::size_t pose = 0; pose < of_pose.size(); ++pose) {
    if (!of_pose[pose]) continue;
    (*json_)["fixtures"].push_back({{"pose", pose},
                                    {"area_mm2", of_pose[pose]->area_mm2},
                                    {"height_mm", of_pose[pose]->height_mm},
                                    {"centre_mm", vector_json(of_pose[pose]->centre)}});
  }
}

void Report::add_next_rest(std::span<const NextRest> suggested, const Transform& pose1_from_pose2) {
  if (!suggested.empty()) (*json_)["next_rest"] = next_rest_json(suggested, pose1_from_pose2);
}

void Report::add_surface(const Mesh& mesh, const VolumeReport& volume) {
  (*json_)["integration"] = volume_json(volume);
  (*json_)["mesh"] = mesh_json(mesh);
}

void Report::add_texture(const TexturedModel& textured) {
  (*json_)["texture"] = {{"atlas_px", textured.mesh.atlas.cols},
                         {"charts", textured.charts},
                         {"texels_per_photo_px", textured.texels_per_px},
                         {"exposure_gain", textured.exposure_gain},
                         {"seen_share", textured.seen_share}};
}

void Report::add_disagreements(std::span<const Disagreement> disagreements) {
  (*json_)["disagreements"] = disagreements_json(disagreements);
}

json Report::finished(const StageLog& log) const {
  json report = *json_;
  report["stages"] = log.to_json();
  return report;
}

}  // namespace scanrig
