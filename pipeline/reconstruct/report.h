#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>

#include "pipeline/pose/estimate_pose.h"
#include "pipeline/pose/fixtures.h"
#include "pipeline/pose/place_poses.h"
#include "pipeline/reconstruct/disagreements.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "pipeline/reconstruct/rest_suggestion.h"
#include "pipeline/reconstruct/rig_watch.h"
#include "pipeline/reconstruct/stage_log.h"
#include "pipeline/reconstruct/turn_by_colour.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/registration/refine_poses.h"
#include "pipeline/registration/register_views.h"
#include "pipeline/texture/texture.h"
#include "pipeline/volume/integrate.h"

namespace scanrig {

/// Collects report.json, docs/reference/report.md. Lengths mm, angles degrees.
class Report {
 public:
  Report(const ReconstructOptions& options, const std::optional<Calibration>& calibration);
  ~Report();
  Report(const Report& other);
  Report(Report&&) noexcept;
  Report& operator=(Report&&) noexcept;

  void add_identity(const ScanIdentity& identity);

  /// `watch`: none without one.
  void add_pose(std::span<const View> views, const RegistrationReport& registration, const VolumeReport& partial,
                const RigWatch* watch);
  void add_estimate(const PoseEstimate& estimate);
  /// After add_estimate(), of a part with a symmetry. `colours`: null without photographs.
  void add_turn(const PoseEstimate& estimate, const ColourDecision* colours);
  /// `is_turn_open`: a turn that changes nothing of the part was held.
  void add_refinement(const RefinedPose& refined, bool is_turn_open);
  /// Of three poses or more. `kept`: poses of the model; `links` count among these.
  void add_placed(const PlacedPoses& placed, std::span<const std::size_t> kept, std::span<const PoseLink> links,
                  const RefinedPoses& refined, bool layers);
  /// One per pose, where it has one.
  void add_fixtures(std::span<const std::optional<Fixture>> of_pose);
  /// `suggested`: to the operator after pose 1; nothing is added where it is empty.
  void add_next_rest(std::span<const NextRest> suggested, const Transform& pose1_from_pose2);
  void add_surface(const Mesh& mesh, const VolumeReport& volume);
  void add_texture(const TexturedModel& textured);
  void add_disagreements(std::span<const Disagreement> disagreements);
  [[nodiscard]] nlohmann::json finished(const StageLog& log) const;

 private:
  std::unique_ptr<nlohmann::json> json_;
};

}  // namespace scanrig
