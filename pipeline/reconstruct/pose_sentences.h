#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>

#include "pipeline/pose/estimate_pose.h"
#include "pipeline/reconstruct/turn_by_colour.h"

/// What a person is told of how the poses lie in one another.
namespace scanrig {

/// Of a symmetric part: which of the motions that fit alike was taken, and why. `colours`: null without photographs.
std::string turn_sentence(const PoseEstimate& estimate, const ColourDecision* colours);

/// The direction in which a pose is known badly, turn or slide; empty where there is none. `pose` from 0; `covariance`
/// of (rotation vector in radians, translation in mm), pose 1's frame. `is_turn_open`: the part has a turn that changes
/// nothing, so its uncertainty harms nothing.
std::string weakness_sentence(std::size_t pose, const Eigen::Matrix<double, 6, 6>& covariance, bool is_turn_open);

}  // namespace scanrig
