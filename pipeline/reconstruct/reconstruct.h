#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "core/transform.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/range/range_image.h"
#include "pipeline/reconstruct/rest_suggestion.h"
#include "pipeline/storage/images.h"
#include "pipeline/storage/pose_choices.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {

struct ReconstructOptions {
  double voxel_mm = 0.0;  ///< of the model; partial models for finding the pose are coarser. 0: kDefaultVoxelMm, or
                          ///< the pixels of imported range images where they are larger
  int threads = 0;        ///< 0: all of the machine's; the result is the same for any number
  std::string fusion = "evidence";  ///< `evidence`, or `paper` for the class table as published
  std::string rests = "hull";       ///< `hull`, or `egi` for the paper's tessellated sphere
  bool texture = true;
  /// `refine`: the rig is compared with its calibration, which is refined where it has moved and refused where it has
  /// moved too far; `report`: compared alone; `off`. Only for calibrations of known quality.
  std::string watch = "refine";
  /// The object stands on putty, pins or a magnet: poses are found without contact with the table, and what only one
  /// pose shows below the object is left out. Without it this is tried where poses do not fit together with contact.
  bool fixture = false;
  double partial_voxel_mm = 0.8;      ///< minimum for partial models: they only serve the search for the pose
  std::optional<Transform> picked{};  ///< pose1_from_pose2 as a person picked it, where several fit; pose_choices.h
  /// Of this process, at its peak: what needs more is done part by part, with the same bits; memory.h.
  std::uintmax_t memory_bytes = std::numeric_limits<std::uintmax_t>::max();
};

/// Origin of the data, for the report.
struct ScanIdentity {
  std::string id;
  std::string profile;  ///< hash of the simulated sensor's profile; empty for a real rig
  std::vector<std::string> config_sha256;
};
/// The identity in the manifest of a whole scan.
ScanIdentity identity_of(const Manifest& manifest);

/// Result of a reconstruction.
struct Model {
  TexturedMesh mesh;  ///< pose 1's turntable frame; atlas empty when there is no colour
  /// report.json: versions, options, hashes, seconds and peak memory per stage, residuals, counts, conflicts, shares.
  std::shared_ptr<const nlohmann::json> report;
};

/// One scan on its way to a model: views are added while the table turns, a pose is closed after its last view.
/// Threads: one user at a time; work inside is spread over `options.threads`.
class Reconstruction {
 public:
  /// A stereo scan.
  Reconstruction(Calibration calibration, ReconstructOptions options);
  /// A scan of imported range images: no calibration, no silhouettes, no colour.
  explicit Reconstruction(ReconstructOptions options);
  ~Reconstruction();
  Reconstruction(Reconstruction&&) noexcept;
  Reconstruction& operator=(Reconstruction&&) noexcept;

  /// Reads one view's images. Called from any thread.
  using ImageSource = std::function<Result<ViewImages>()>;

  /// The views' images are also in this scan folder, in the order in which they are added here: of large images
  /// (thinning_step()) photographs are read again from there when they are wanted, and not kept.
  void images_are_in(std::filesystem::path scan_folder);

  /// Range images and silhouettes of views, side by side; they are added in their order, with the bits of one at a
  /// time. `context` is told of the progress of a single one. Fails as add_view() and the sources do; none is added
  /// then.
  Result<void> add_views(std::size_t pose, std::span<const ImageSource> sources, const Context& context);
  /// Range image and silhouettes of one view. `pose` counts from 0, up to kMaxPoses. Fails with `invalid_input`
  /// (options, sizes), `degenerate` (nothing seen), `out_of_range` (the object is larger than the working volume),
  /// `stopped`.
  Result<void> add_view(std::size_t pose, const ViewImages& images, const Context& context);
  /// An imported range image, placed in its pose.
  Result<void> add_range_view(std::size_t pose, int index, double angle_rad, RangeImage range, const Context& context);

  /// Watches the rig, registers the pose's views and makes its partial model. Fails with `below_limits` (the rig is no
  /// longer as calibrated), `invalid_input` (options), `degenerate`, `no_overlap`, `stopped`.
  Result<void> finish_pose(std::size_t pose, const Context& context);

  /// The view that was added last, and a finished pose, as coarse coloured meshes to be shown; live_mesh.h. Empty
  /// without such a view, and of imported range images.
  [[nodiscard]] Mesh live_view(std::size_t pose) const;
  [[nodiscard]] Mesh live_pose(std::size_t pose) const;
  /// The best other rests of a finished pose's object, with images from live_pose(). They are kept for the report,
  /// which then says whether pose 2 lies on one of them; the search for the pose does not use them. Empty where there
  /// is none, and of imported range images.
  [[nodiscard]] std::vector<RestSuggestion> suggest_rests(std::size_t pose, const Mesh& live_pose);

  /// All poses into one frame, that of the first which is kept, and integration: what finish() begins with, sooner. Of
  /// three poses or more, one that does not fit is left out, and the report names it. Every pose must be finished
  /// before, none comes after. Fails with `same_rest`, `ambiguous`, `no_overlap`, `degenerate`, `stopped`.
  Result<void> prepare(const Context& context);
  /// Of two poses, after prepare() or finish() failed with `ambiguous`: the motions that fit, best first.
  [[nodiscard]] std::vector<PoseChoice> choices() const;
  /// As prepare(), then the texture; with one pose, its own complete model. Once: the views are let go. Fails as
  /// prepare(), and as ScanFolder where photographs are read again.
  Result<Model> finish(const ScanIdentity& identity, const Context& context);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Reconstructs a scan folder from its files. Same input and options, same bits. Fails as the stages and the files do,
/// and with `invalid_input` for an incomplete scan, `out_of_range` where not even the least fits into the memory.
Result<Model> reconstruct(const ScanFolder& scan, const ReconstructOptions& options, const Context& context);

/// Mesh, texture and report.json into `folder` (made or replaced as a whole). Fails with `io`.
/// `threads`: as in ReconstructOptions.
Result<void> write_model(const Model& model, const std::filesystem::path& folder, int threads);

}  // namespace scanrig
