#pragma once

#include <filesystem>
#include <optional>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/evaluate/scores.h"
#include "pipeline/evaluate/texture_figures.h"
#include "pipeline/evaluate/true_view.h"
#include "pipeline/evaluate/truth_file.h"
#include "pipeline/mesh/alignment.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

struct EvaluateOptions {
  std::size_t samples = 200'000;       ///< spread over each surface
  std::size_t sigma_samples = 40'000;  ///< of measured area, for the classes of sigma
  double carve_voxel_mm = 0.5;         ///< of the ideal carve
  ObservableRule observable;
  AlignmentOptions alignment;
  TextureFigureOptions texture;
};

/// How well a reconstruction says it knows `pose1_from_pose2`.
struct PoseUncertainty {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< pose 1's turntable frame
  /// Of (rotation vector in radians about `centre`, translation in mm).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
};

/// Where a reconstruction of three poses or more says that one of them lies.
struct ClaimedPose {
  std::size_t pose = 2;  ///< from 0
  Transform frame_from_pose = Transform::Identity();
  std::optional<PoseUncertainty> uncertainty{};
};

/// A model to be judged.
struct Claim {
  TexturedMesh model;                        ///< turntable frame of `frame_of_pose`; `views` and `sigma` are its claims
  std::size_t frame_of_pose = 0;             ///< the first pose that was kept
  std::vector<ClaimedPose> further_poses{};  ///< all but pose 2 in pose 1
  std::optional<Transform> pose1_from_pose2;  ///< as the reconstruction found it
  std::optional<PoseUncertainty> pose_uncertainty = {};
};

/// Judges a model against the truth by the rules of pipeline/evaluate/README.md. `photos`: the scan's plain images for
/// the texture's figures, or null. Stages reported: "evaluate".
/// Fails with `degenerate` (a mesh without faces), `stopped`, and as the photos' loading does.
Result<Scores> evaluate(const Claim& claim, const Truth& truth, const ScanFolder* photos,
                        const EvaluateOptions& options, const Context& context);

/// The model that a reconstruction left in `folder`: model.ply, texture coordinates of model.obj and model.png if
/// present, the motions between the poses of report.json if present, with their uncertainty. Fails with `not_found`,
/// `io`, `invalid_input`.
Result<Claim> read_claim(const std::filesystem::path& folder);

/// Number of the truth's views in which each sample is observable.
std::vector<int> observable_views(const std::vector<SurfaceSample>& samples, const Truth& truth,
                                  const SurfaceIndex& surface, const ObservableRule& rule);

}  // namespace scanrig
