#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "pipeline/pose/fixtures.h"
#include "pipeline/registration/moved_views.h"
#include "pipeline/texture/texture.h"
#include "pipeline/volume/silhouette_votes.h"

namespace scanrig {

/// One image, the object in one view, or a whole pose, that the other images of its scan contradict.
struct Disagreement {
  std::size_t pose = 0;
  int view = 0;
  std::string camera{};    ///< `left`, `right`; empty: of the view
  std::string what{};      ///< `silhouette`, `photograph`, `object moved`, `view`, `pose`, `fixture`
  std::string action{};    ///< `part left out`, `left out`, `corrected`, `kept`
  double amount = 0.0;     ///< in `unit`
  std::string unit{};      ///< `share` of the object's area in the image, or `mm`
  std::string sentence{};  ///< for the operator; poses and views from 1
};

Disagreement of_silhouette(std::size_t pose, const SilhouetteFinding& finding);
/// Views without silhouettes although the camera sees colour, `count` of `all`; `view` is the first.
Disagreement of_missing_screen(std::size_t pose, int view, std::size_t count, std::size_t all);
/// The object has parts in the screen's colour: `share` of what views measured is outside of several silhouettes.
Disagreement of_screen_colour(std::size_t pose, double share);
Disagreement of_motion(std::size_t pose, const View& view, const ObjectMotion& motion);
/// The view was left out.
Disagreement of_misfit(std::size_t pose, const View& view, double residual_mm);
/// The pose was left out.
Disagreement of_pose(std::size_t pose, std::string sentence);
/// What held the object in the pose was left out. `is_expected`: the recipe has a fixture.
Disagreement of_fixture(std::size_t pose, const Fixture& fixture, bool is_expected);
/// A fixture cannot be told from the object in a scan of one pose.
Disagreement of_single_pose_on_fixture();
Disagreement of_photo(std::size_t pose, int view, std::size_t camera, const ContradictedPhoto& photo);

nlohmann::json disagreements_json(std::span<const Disagreement> disagreements);

}  // namespace scanrig
