#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/pose/patches.h"

namespace scanrig {

/// The rotations that carry an object's surface onto itself, as far as sigma and sampling tell. Pose 1's frame, mm.
struct Symmetry {
  enum class Group { none, cyclic, dihedral, axial, spherical, tetrahedral, cubic, icosahedral, other };
  enum class Of { both_poses, pose1, pose2 };  ///< the surface that has it: of the object, or of what one pose saw
  Group group = Group::none;
  Of of = Of::both_poses;
  int fold = 1;                                     ///< of the axis; 0: any turn about it (`axial`, `spherical`)
  bool two_sided = false;                           ///< `axial`: turning it end for end changes nothing either
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();   ///< unit; the main one; 0 for `none` and `spherical`
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis; the centre where the group fixes one point
  std::size_t motions = 1;                          ///< that fit equally well; 0: infinitely many
  std::vector<Transform> elements = {Transform::Identity()};  ///< of a finite group, the identity first; of the others
                                                              ///< one per free turn: the identity, and end for end
  [[nodiscard]] bool is_continuous() const { return fold == 0; }
  /// The turns that nothing of the shape holds: one about an axis, three of a ball.
  [[nodiscard]] std::vector<FreeTurn> free_turns() const;
};

const char* to_string(Symmetry::Group group);
const char* to_string(Symmetry::Of of);
/// One sentence for the operator, without a full stop: "the part is the same after every turn about one axis".
std::string describe(const Symmetry& symmetry);

struct SymmetryOptions {
  int level = 1;               ///< of the range pyramid
  int iterations = 8;          ///< of the alignment of the surface with itself
  double capture = 0.02;       ///< its capture distance as a share of the object's size
  double reach = 0.015;        ///< of the checks, as a share of the object's size
  double min_confirmed = 0.3;  ///< share of the surface that the motion carries onto measured surface
  double same_deg = 4.0;       ///< rotations and axes closer than this are one
  double same_mm = 0.5;        ///< farthest that an axis may miss the others' common point
  int max_fold = 12;           ///< finest turn that is told from any turn
  std::size_t max_elements = 60;
  double max_misfits = 0.004;   ///< share of the judged patches that may contradict: single ones beside edges
  std::size_t min_misfits = 3;  ///< so many must contradict
  double max_far_off = 0.002;   ///< far_off(), beyond that of the surface where it is: features below a patch
  PatchOptions patches;
};

/// Measured surface that is compared with itself.
class SelfComparison {
 public:
  /// `views`: of one pose or of both, placed in pose 1's frame. `spread_mm`, `patch_spread_mm`: see patches.h.
  SelfComparison(std::vector<View> views, int levels, double spread_mm, double patch_spread_mm,
                 const AgreementOptions& agreement, const SymmetryOptions& options);

  /// The motion near `motion` that carries the surface and the silhouettes onto themselves; nothing where it does not.
  /// `held`: turns that alignment leaves as they are.
  [[nodiscard]] std::optional<Transform> symmetric_near(const Transform& motion,
                                                        std::span<const FreeTurn> held = {}) const;
  [[nodiscard]] const Eigen::Vector3d& middle() const { return middle_; }
  /// The point of this line halfway between the ends of the surface along it: where a turn end for end has its axis.
  [[nodiscard]] Eigen::Vector3d halfway(const Eigen::Vector3d& axis, const Eigen::Vector3d& point) const;
  /// The point nearest to all normals: the centre of a ball.
  [[nodiscard]] const Eigen::Vector3d& focus() const { return focus_; }

 private:
  [[nodiscard]] std::vector<SampleCheck> checks_of(const Transform& motion) const;
  /// Share of what was judged that contradicts by `AgreementOptions::wide_tolerance`: not what edges do.
  [[nodiscard]] double far_off(const std::vector<SampleCheck>& checks) const;

  std::vector<View> views_;
  MeasuredPose measured_;
  Patches patches_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero(), focus_ = Eigen::Vector3d::Zero();
  double spread_mm_, patch_spread_mm_;
  double far_off_unmoved_ = 0.0;
  AgreementOptions agreement_;
  SymmetryOptions options_;
};

/// The group of `surface` that holds all `motions`, each a rotation of at least `same_deg`; nothing where one of them
/// does not carry the surface onto itself. The group is what follows from the motions, with finer turns about their
/// axes and turns end for end where these fit too. Same bits for any number of threads.
std::optional<Symmetry> find_symmetry(const SelfComparison& surface, std::span<const Transform> motions,
                                      const SymmetryOptions& options);

}  // namespace scanrig
