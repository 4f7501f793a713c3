#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/pose/next_rest.h"

namespace scanrig {

/// One way to lay the object down for the next pose, for the operator.
struct RestSuggestion {
  NextRest next;
  std::string sentence{};  ///< "Lay it on its back: shows 81 % of what is unseen."
  std::string doubt{};     ///< why its pose may not be found; empty: it can be
  std::string png{};       ///< the object on that rest; empty: not drawn
};

constexpr std::size_t kSuggestedRests = 2;

/// The best of `found`, with sentences. Front is the side towards the cameras at table angle 0, where the table stands
/// while the object is turned over; left and right are as the cameras see it.
std::vector<RestSuggestion> suggestions_of(const NextRests& found, const Calibration& calibration);

struct RestImageOptions {
  int width = 480, height = 360;
  int supersample = 2;
};

/// The object on that rest as one sees it from between the cameras, on the table at angle 0, as PNG. `partial`: closed,
/// in the pose's frame, with `views`, `normals` and the photographs' colours; what is unseen so far is orange. Fails
/// with `invalid_input` (an attribute is missing), and as the renderer.
Result<std::string> draw_rest(const Mesh& partial, const NextRest& next, const Calibration& calibration,
                              const RestImageOptions& options = {});

/// The measured surface of both poses in one frame, from between the cameras and from the other side, as PNG. Both as
/// `partial` of draw_rest(). Fails as that.
Result<std::string> draw_choice(const Mesh& pose1, const Mesh& pose2, const Transform& pose1_from_pose2,
                                const Calibration& calibration);

/// `next_rest` of report.json: what was suggested, and on which of it the object was laid; docs/reference/report.md.
nlohmann::json next_rest_json(std::span<const NextRest> suggested, const Transform& pose1_from_pose2);

}  // namespace scanrig
