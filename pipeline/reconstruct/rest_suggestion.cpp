#include "pipeline/reconstruct/rest_suggestion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/units.h"

namespace scanrig {
namespace {

constexpr double kUpsideDownDeg = 150.0;  // of turn: more is said as half a turn
constexpr double kOnItsSideDeg = 50.0;    // less is a tilt

Eigen::Vector3d centre_between(const Calibration& calibration) {
  return 0.5 * (calibration.left.camera_from_turntable.inverse().translation() +
                calibration.right.camera_from_turntable.inverse().translation());
}

/// Of the four sides of the object as it stands, the one that points most along `direction`.
std::string_view side_of(const Eigen::Vector3d& direction, const Eigen::Vector3d& front) {
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(front);
  const double ahead = direction.dot(front), aside = direction.dot(right);
  if (std::abs(ahead) >= std::abs(aside)) return ahead > 0.0 ? "front" : "back";
  return aside > 0.0 ? "right side" : "left side";
}

std::string way_of(const NextRest& next, const Eigen::Vector3d& front) {
  const double turn_deg = to_degrees(std::acos(std::clamp(-next.rest.normal.y(), -1.0, 1.0)));
  if (turn_deg > kUpsideDownDeg) return "Turn it upside down";
  const std::string_view side = side_of(next.rest.normal, front);
  if (turn_deg > kOnItsSideDeg) return fmt::format("Lay it on its {}", side);
  return fmt::format("Tilt it towards its {}", side);
}

std::string doubt_of(PoseOutlook outlook) {
  switch (outlook) {
    case PoseOutlook::findable: return "";
    case PoseOutlook::small_overlap: return "Its pose may not be found: too little is seen in both poses.";
    case PoseOutlook::weak:
      return "Its pose may be known less well: what both poses see can turn or slide along itself.";
  }
  return "";
}

std::string_view name_of(PoseOutlook outlook) {
  switch (outlook) {
    case PoseOutlook::findable: return "findable";
    case PoseOutlook::small_overlap: return "small overlap";
    case PoseOutlook::weak: return "weak";
  }
  return "";
}

nlohmann::json axis_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::vector<RestSuggestion> suggestions_of(const NextRests& found, const Calibration& calibration) {
  Eigen::Vector3d front = centre_between(calibration);
  front.y() = 0.0;
  front.normalize();
  std::vector<RestSuggestion> suggestions;
  for (const NextRest& next : found.rests) {
    if (suggestions.size() == kSuggestedRests) break;
    suggestions.push_back(
        {.next = next,
         .sentence = fmt::format("{}: shows {:.0f} % of what is unseen.", way_of(next, front), 100.0 * next.gain),
         .doubt = doubt_of(next.outlook)});
  }
  return suggestions;
}

nlohmann::json next_rest_json(std::span<const NextRest> suggested, const Transform& pose1_from_pose2) {
  const Eigen::Vector3d down = pose1_from_pose2.linear() * -Eigen::Vector3d::UnitY();
  const int taken = index_of_rest(suggested, down);
  nlohmann::json all = nlohmann::json::array();
  for (const NextRest& next : suggested) {
    all.push_back({{"normal", axis_json(next.rest.normal)},
                   {"gain", next.gain},
                   {"unseen_after", next.unseen_after},
                   {"overlap", next.overlap},
                   {"stiffness", next.stiffness},
                   {"outlook", name_of(next.outlook)}});
  }
  nlohmann::json json = {{"suggested", std::move(all)},
                         {"down_in_pose1", axis_json(down)},
                         {"taken", taken < 0 ? nlohmann::json() : nlohmann::json(taken + 1)},
                         {"sentence", nlohmann::json()}};
  if (taken < 0 && !suggested.empty()) {
    json["sentence"] = "The part was laid on another rest than those that were suggested.";
  }
  return json;
}

}  // namespace scanrig
