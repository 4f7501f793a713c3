#pragma once

#include <nlohmann/json.hpp>

#include "core/result.h"
#include "tests/bench/pose/campaign_rig.h"

/// One trial of a campaign: an object is drawn, scanned in two rests, and its pose found as a reconstruction does.
namespace scanrig::campaign {

/// Where pose 2 lies: as pose 1 does, turned and moved on the table; on any other rest; on another one that is not
/// within 20 deg of upside down; on one that is.
enum class Flip { none, any, beside, upside_down };

struct TrialOptions {
  double min_overlap = 0.25;  ///< of the surface seen in both poses, as a share of what the lesser pose shows
  Flip flip = Flip::beside;
  bool tries_generators = false;         ///< each generator alone, too
  const DrawnObject* another = nullptr;  ///< pose 2 is of this one
};

/// What the pipeline made of it, and the truth. Fails with `degenerate` where the object has no such rests.
Result<nlohmann::json> run_trial(const DrawnObject& object, const TrialOptions& options, Chance& chance);

}  // namespace scanrig::campaign
