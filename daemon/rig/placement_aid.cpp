#include "daemon/rig/placement_aid.h"

#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

constexpr auto kBetweenLooks = std::chrono::milliseconds(500);

}  // namespace

Result<PlacementView> PlacementAid::look(const AwaitedPlacement& awaited) {
  const auto pair = preview_.latest();  // also requests the next one
  if (!pair) return pass_on(pair);
  const std::scoped_lock lock(mutex_);
  if (seen_ && seen_for_ == awaited && clock_.now() < not_before_) return *seen_;
  const auto calibration = read_calibration(calibration_file_);
  const auto& plan = calibration_plan();
  seen_ = compare_placement(pair->left, pair->right, to_string(pair->format), board_,
                            plan.at(static_cast<std::size_t>(awaited.placement)), calibration ? &*calibration : nullptr,
                            awaited.table_deg);
  seen_for_ = awaited;
  not_before_ = clock_.now() + kBetweenLooks;
  return *seen_;
}

}  // namespace scanrig
