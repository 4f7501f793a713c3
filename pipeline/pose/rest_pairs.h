#pragma once

#include <span>
#include <vector>

#include "core/transform.h"
#include "pipeline/pose/stable_rests.h"
#include "pipeline/registration/refine_pose.h"

namespace scanrig {

/// The table's outward normal seen from the object: the plane under the object in either pose.
inline Eigen::Vector3d base_normal() { return -Eigen::Vector3d::UnitY(); }

/// A solid in its pose's turntable frame and the planes it can rest on.
struct RestingSolid {
  SolidProperties properties;
  double height_mm = 0.0;  ///< above the table in its own pose
  std::vector<StableRest> rests;
};

/// The rest of solid 1 on which pose 2 lies, with the rest of solid 2 on which pose 1 lies.
struct RestPair {
  StableRest of_pose1;
  StableRest of_pose2;
  double cost = 0.0;  ///< squared misfit of angle and heights in units of their tolerances; the smaller the better
};

struct RestPairOptions {
  double angle_sigma_deg = 6.0;  ///< smooth contacts make normals jitter by degrees
  double height_sigma_mm = 2.0;  ///< or `height_sigma` of the size: partial models are closed by their hull
  double height_sigma = 0.04;
  double max_contact_deg = 3.0;    ///< a pair gives its table contacts to motions that agree with it within this
  double centre_weight = 0.02;     ///< of the centres of mass against the contacts: inaccurate in partial models
  double upside_down_deg = 30.0;   ///< within this of upside down the two contacts are one: full circle of swivels
  double turned_back_deg = 175.0;  ///< the same beyond this angle from upside down
  int full_circle_steps = 36;      ///< swivels of the full circle
  double swivel_deg = 12.0;        ///< else the closed form and its neighbours at this angle
  int max_pairs = 40;  ///< the best are kept, however poor: crudely closed models give heights wrong by centimetres
};

/// Pairs of rests, best first, that agree on the angle to the base, angle(n_T1, n_B) = angle(n_T2, n_B), and on the
/// heights, extent(V1, n_T1) = H2 and extent(V2, n_T2) = H1. The only limit is the number of pairs [measured: a hard 3
/// deg gate loses the true pair in 2 of 10 trials].
std::vector<RestPair> pair_rests(const RestingSolid& pose1, const RestingSolid& pose2, const RestPairOptions& options);

/// pose1_from_pose2 of a pair: R n_T2 = n_B and R n_B = n_T1, both met equally well (TRIAD on the bisectors), then
/// turned by `swivel` radians about n_T1. Contact fixes the translation along n_B and n_T1, the centres of mass the
/// rest.
Transform transform_of(const RestPair& pair, const SolidProperties& pose1, const SolidProperties& pose2, double swivel,
                       const RestPairOptions& options = {});

/// Table contacts for a motion: those of the pair that agrees with it best, pose 2's rest on pose 1's table and pose
/// 1's rest on pose 2's; none where no pair agrees within 3 deg.
std::vector<Contact> contacts_for(const Transform& pose1_from_pose2, std::span<const RestPair> pairs,
                                  const SolidProperties& pose2, const RestPairOptions& options = {});

/// The swivels to try. Within 30 deg of upside down the two contacts are one and any angle about the vertical fits:
/// the full circle; beyond, the closed form and its neighbours, since normals of smooth contacts jitter.
std::vector<double> swivels_of(const RestPair& pair, const RestPairOptions& options = {});

/// The pair for "not turned over": both poses rest on the same face; any angle about the vertical fits.
RestPair same_rest_pair(const RestingSolid& pose1, const RestingSolid& pose2);

}  // namespace scanrig
