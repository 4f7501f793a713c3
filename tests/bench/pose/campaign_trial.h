#pragma once

#include <nlohmann/json.hpp>

#include "core/result.h"
#include "tests/bench/pose/campaign_rig.h"

/// One trial of a campaign: an object is drawn, scanned in two rests, and its pose found as a reconstruction does.
namespace scanrig::campaign {

struct TrialOptions {
  double min_overlap = 0.25;      ///< of the surface seen in both poses, as a share of what the lesser pose shows
  bool is_upside_down = false;    ///< turned over to within 20 deg of upside down; else to any other rest
  bool tries_generators = false;  ///< each generator alone, too
};

/// What the pipeline made of it, and the truth. Fails with `degenerate` where the object has no such rests.
Result<nlohmann::json> run_trial(const DrawnObject& object, const TrialOptions& options, Chance& chance);

}  // namespace scanrig::campaign
