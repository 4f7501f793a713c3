#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pipeline/pose/pose_search.h"

/// Motions that fit equally well and give the same surface. Internal to this folder.
namespace scanrig {

/// The symmetry that makes all rivals one answer: of the object as both poses show it, or else of what one of them
/// shows, which then has the same surface wherever the other puts it. Nothing where surfaces differ.
std::optional<Symmetry> symmetry_of(const Hypothesis& best, std::span<const Candidate* const> rivals,
                                    const PoseInput& pose1, const PoseInput& pose2, const Scene& scene,
                                    const PoseOptions& options);

/// Whether the object may have been turned over although `not_turned` fits: there are motions that turn it over and fit
/// too, and what none of them shows a second time lies flat on the other pose's table, as the ends of a cylinder do.
/// The hollow of a cup does not: that it is seen twice shows that the cup was left as it stood.
bool may_be_turned_over(const Transform& not_turned, const Symmetry& symmetry, const Scene& scene,
                        const PoseOptions& options);

/// Of the motions that fit alike, one that turns the object over comes first: that is what was asked for, and it shows
/// more of the surface.
void prefer_turned_over(std::vector<Hypothesis>& field, const Symmetry& symmetry, const Scene& scene,
                        const PoseOptions& options);

}  // namespace scanrig
