#pragma once

#include <vector>

#include "pipeline/registration/refine_pose.h"

namespace scanrig {

/// Where flat, measured surface of one pose lies on the other's table, as the motion carries it: what is lowest there,
/// within 1.5 % of the object's size of the table. Edges may hold the height of an object that was turned upside down,
/// and are measured worst; such surface tells it better. Not for an object on a fixture.
std::vector<Contact> flat_contacts(const MeasuredPose& pose1, const MeasuredPose& pose2,
                                   const Transform& pose1_from_pose2);

}  // namespace scanrig
