#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/station/snapshot.h"
#include "drivers/camera/stereo_camera.h"
#include "pipeline/calibration/placement/placement_aid.h"

namespace scanrig {

enum class Side { left, right };
/// All of an image, or its middle in full resolution, to focus by: 512 pixels, less where the image is smaller.
enum class Extent { whole, middle };

/// Camera images for people: the pair of the latest exposure, or of a preview. A preview is taken on request, when
/// nothing else has to be done. It never disturbs a scan.
/// Threads: every function may be called from any.
class Preview {
 public:
  /// `quiet`: no scan is running and nothing moves, so the cameras are free.
  Preview(Clock& clock, std::function<bool()> quiet) : clock_(clock), quiet_(std::move(quiet)) {}

  /// The latest image of one side as a JPEG; requests a newer pair. Fails with `not_found` (no pair yet: try again),
  /// and as the preview failed while the cameras are free.
  Result<std::string> jpeg(Side side, Extent extent = Extent::whole);

  /// The same pair as it was taken. Fails as jpeg().
  Result<StereoFrame> latest();

  // For the rig.

  /// `look` is called when a pair is wanted; one keep() or failed() replies to it. Null: no more previews.
  void on_wanted(std::function<void()> look);
  void keep(const StereoFrame& pair);
  void failed(const Error& error);

 private:
  void ask_for_more();
  Result<void> look(bool quiet);

  struct Encoded {
    std::uint64_t pair = 0;
    std::string bytes;
  };

  Clock& clock_;
  const std::function<bool()> quiet_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::function<void()> look_;
  bool asked_ = false;
  Clock::TimePoint not_before_{};  ///< no preview until then
  std::uint64_t pairs_ = 0;
  StereoFrame latest_;
  std::optional<Error> problem_;  ///< of the last preview
  std::array<Encoded, 2> encoded_;
};

/// How the calibration board stands while it is put in place. Nothing moves for it: on a request it analyses the
/// preview's pairs, at most twice a second. Threads: any; one analyses, others wait for it.
class PlacementAid {
 public:
  /// `calibration_file`: the rig's, which places the board; read anew each time, as it may be missing.
  PlacementAid(Clock& clock, Preview& preview, Board board, std::filesystem::path calibration_file)
      : clock_(clock), preview_(preview), board_(std::move(board)), calibration_file_(std::move(calibration_file)) {}

  /// Fails as Preview::latest().
  Result<PlacementView> look(const AwaitedPlacement& awaited);

 private:
  Clock& clock_;
  Preview& preview_;
  const Board board_;
  const std::filesystem::path calibration_file_;
  std::mutex mutex_;
  // Guarded by mutex_: the last analysis.
  std::optional<PlacementView> seen_;
  AwaitedPlacement seen_for_;
  Clock::TimePoint not_before_{};
};

}  // namespace scanrig
