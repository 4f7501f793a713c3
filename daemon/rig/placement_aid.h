#pragma once

#include <filesystem>
#include <mutex>
#include <optional>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/rig/preview.h"
#include "daemon/station/snapshot.h"
#include "pipeline/calibration/placement/placement_aid.h"

namespace scanrig {

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
