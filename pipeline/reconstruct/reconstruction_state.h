#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/pose/fixtures.h"
#include "pipeline/pose/place_poses.h"
#include "pipeline/range/compact_range.h"
#include "pipeline/range/rectification.h"
#include "pipeline/range/thinned_view.h"
#include "pipeline/reconstruct/disagreements.h"
#include "pipeline/reconstruct/kept_photo.h"
#include "pipeline/reconstruct/live_mesh.h"
#include "pipeline/reconstruct/reconstruct.h"
#include "pipeline/reconstruct/report.h"
#include "pipeline/reconstruct/rest_suggestion.h"
#include "pipeline/reconstruct/rig_watch.h"
#include "pipeline/reconstruct/stage_log.h"
#include "pipeline/reconstruct/turn_by_colour.h"
#include "pipeline/registration/register_views.h"
#include "pipeline/texture/texture.h"
#include "pipeline/volume/integrate.h"

namespace scanrig {

/// The contacts of a symmetric part after `element`, a motion that carries it onto itself.
std::vector<Contact> carried(std::vector<Contact> contacts, const Transform& element);

/// Fails with `invalid_input`: neither "hull" nor "egi".
Result<PoseOptions> pose_options_of(const std::string& rests);

/// What a Reconstruction holds. reconstruct.cpp has its stages, judge_pose.cpp what they say of single images,
/// photographs.cpp where these are.
struct Reconstruction::State {
  struct PlainPair {
    KeptPhoto left, right;
  };
  struct GreyPair {
    std::size_t order;    ///< of the view in its pose, as added
    cv::Mat left, right;  ///< 8 bit, or merged exposures of 16
  };

  struct PoseState {
    std::vector<View> views;         ///< thinned, where images are large
    std::vector<CompactRange> full;  ///< then their range images as measured; else empty
    std::vector<PlainPair> plain;    ///< one per view; empty for range scans and grey sensors
    std::vector<GreyPair> pattern;   ///< likewise
    /// Of each view, points of its fixture in the pose's frame; empty: none.
    std::vector<std::vector<Eigen::Vector3f>> in_front;
    std::optional<RigWatch> watch;  ///< none: range scans, or switched off
    RegistrationReport registration;
    Surface partial;
    std::vector<NextRest> suggested;  ///< to the operator, for the next pose
    bool finished = false;
  };

  /// Places of the poses. `layers`: photographs of one may lie otherwise on the surface than another's.
  struct FoundPoses {
    std::vector<std::optional<Transform>> model_from_pose{};  ///< nothing: left out. The first that is kept: identity
    bool layers = false;
    double seen_empty = 0.0;  ///< largest share of two poses' surface that the other pose looked through, or more
  };

  /// What finish() needs of the finished poses alone.
  struct Prepared {
    FoundPoses found;
    Surface surface;
    Report report;
  };

  ReconstructOptions options;
  std::optional<Calibration> calibration;
  std::optional<Rectification> rectification;
  std::vector<PoseState> poses;
  std::vector<Disagreement> disagreements;
  std::vector<PoseChoice> choices;               ///< of the search that ended `ambiguous`
  std::vector<std::optional<Fixture>> fixtures;  ///< of each pose, taken out of its views; empty: not looked for
  std::optional<Prepared> prepared;
  StageLog log;

  std::filesystem::path folder;  ///< with the views' images; empty: they are kept

  [[nodiscard]] int step() const { return calibration ? thinning_step(calibration->left.projection) : 1; }
  [[nodiscard]] bool reads_again() const { return step() > 1 && !folder.empty(); }
  Result<PoseState*> open_pose(std::size_t pose);
  Result<void> rectify_once();
  [[nodiscard]] Result<View> view_of(std::size_t pose, const ViewImages& images, const Context& context) const;
  Result<void> add_views(std::size_t pose, std::span<const ImageSource> sources, const Context& context);
  void take_view(PoseState& pose, View view, const ViewImages& images, WatchMode mode);
  Result<void> judge_rig(PoseState& pose, const Context& context);
  Result<void> register_pose(std::size_t pose, const Context& context);
  Result<void> align_views(std::size_t pose, const Context& context);
  Result<void> judge_silhouettes(std::size_t pose, const Context& context);
  Result<void> judge_silhouettes_of_all(const FoundPoses& found, const Context& context);
  Result<void> measure_without_key(std::size_t pose, const Context& context);
  bool undo_motions(std::size_t pose, const RegistrationOptions& priors);
  bool leave_out_misfits(std::size_t pose);
  Result<void> finish_pose(std::size_t pose, const Context& context);
  [[nodiscard]] Mesh live_pose(std::size_t pose) const;
  std::vector<RestSuggestion> suggest_rests(std::size_t pose, const Mesh& live_pose);
  /// Of one pose, of two (find_pose.cpp) and of more (find_poses.cpp), with fixtures or without (find_on_fixtures.cpp).
  Result<FoundPoses> find_poses(Report& report, const Context& context);
  Result<FoundPoses> find_touching(const PoseOptions& pose_options, Report& report, const Context& context);
  Result<FoundPoses> find_on_fixtures(const PoseOptions& pose_options, const FoundPoses* sketch, Report& report,
                                      const Context& context);
  bool shows_fixture(const FoundPoses& found);
  void remove_fixtures(std::span<const std::optional<Transform>> model_from_pose);
  void remove_fixtures_in_full();
  void drop_fixtures();
  void note_fixtures(Report& report);
  Result<FoundPoses> find_second_pose(const PoseOptions& pose_options, Report& report, const Context& context);
  void keep_choices(const std::vector<Candidate>& fitting);
  Result<FoundPoses> find_many_poses(const PoseOptions& pose_options, Report& report, const Context& context);
  Result<FoundPoses> choose_turn(const PoseEstimate& estimate, Report& report, const Context& context);
  Result<void> choose_turns(const PlacedPoses& placed, FoundPoses& found, const Context& context);
  [[nodiscard]] RefineOptions refine_options() const;
  [[nodiscard]] std::uintmax_t bytes_left() const;
  Result<Surface> surface(const FoundPoses& found, const Context& context);
  void set_view(PoseState& pose, std::size_t v, View view) const;
  void crop_photos(PoseState& pose) const;
  void release_range_images();
  Result<ViewImages> whole_images(std::size_t pose, std::size_t v) const;
  Result<KeptPhoto> photo(const ScanFolder* scan, std::size_t pose, std::size_t v, std::size_t camera) const;
  Result<std::vector<Photo>> photos(const FoundPoses& found) const;
  Result<void> add_photos(const ScanFolder* scan, std::size_t pose, const Transform& pose_from_model,
                          std::vector<Photo>& photos) const;
  Result<ColourDecision> turn_by_colours(std::size_t pose1, std::size_t pose2, const PoseEstimate& estimate,
                                         const Context& context) const;
  [[nodiscard]] LivePhoto live_photo(std::size_t pose, std::size_t v) const;
  Result<void> add_texture(TexturedMesh& model, const FoundPoses& found, Report& report, const Context& context);
  Result<void> prepare(const Context& context);
  Result<Model> finish(const ScanIdentity& identity, const Context& context);
};

}  // namespace scanrig
