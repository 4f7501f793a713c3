#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/context.h"
#include "core/result.h"
#include "pipeline/pose/agreement.h"
#include "pipeline/pose/point_pairs.h"
#include "pipeline/pose/pose_graph.h"

/// Pairs of single views in unknown positions: which motions could be, and what both views say of one. Internal to this
/// folder.
namespace scanrig {

/// Lengths are shares of the views' median size, so that nothing depends on the object.
struct ViewPairOptions {
  int levels = 4;      ///< of the range pyramid
  int proposals = 60;  ///< motions from point pairs for each pair of views
  double proposal_reach = 0.05;
  std::size_t kept_coarse = 10, kept_middle = 4;  ///< of them after each narrowing
  double coarse_capture = 0.08, coarse_reach = 0.04;
  double fine_capture = 0.03, fine_reach = 0.02;
  int iterations = 12;               ///< of each alignment
  double same_deg = 5.0;             ///< motions closer than this and ...
  double same_shift = 0.05;          ///< ... this are one
  double min_confirmed = 0.08;       ///< share of both views' surfaces
  double max_contradicted = 0.2;     ///< contradicted share of what was judged
  double max_median = 0.006;         ///< distance of the surfaces, and ...
  double max_roughness = 5.0;        ///< ... the same in their own roughness, but ...
  double min_pixels = 0.5;           ///< ... not below this many pixels of a view
  double max_condition = 1e4;        ///< beyond it some motion is not held: a slide along a plane, a turn of a ball
  double max_tolerated = 0.03;       ///< contradicted share of both surfaces that errors of other pairs explain
  double spread_of_median = 1.4826;  ///< standard deviation of normal noise, in medians of its amount
  AgreementOptions agreement{.witnesses = 1, .has_table = false};
  PointPairOptions voting;
};

/// One view against another, under one motion.
struct ViewFitCheck {
  Transform view1_from_view2 = Transform::Identity();
  std::vector<SampleCheck> checks;
  double condition = 0.0;
};

/// Views, each in a frame of its own, ready to be compared.
/// Threads: the const functions may be called from several.
class ViewPairs {
 public:
  /// `views`: frames of their own, whose origins lie within the measured surface; they must outlive the object.
  ViewPairs(std::span<const View> views, const ViewPairOptions& options);

  /// Motions of all pairs that fit, best first; `confirmed` is less twice what contradicts. Point pairs of one view
  /// look theirs up in the other's; what they propose is aligned, checked and narrowed [Huber and Hebert 2003, pairwise
  /// matching]. Fails with `stopped`.
  Result<std::vector<PairMotion>> match(const Context& context);
  /// What both views say of a motion that follows from other pairs, after alignment near it: surface agreement and
  /// visibility, free space before each surface [Huber and Hebert 2003, 4].
  [[nodiscard]] PairVerdict judge(std::size_t view1, std::size_t view2, const Transform& view1_from_view2) const;

  [[nodiscard]] const PoseGraphOptions& graph_options() const { return graph_options_; }
  [[nodiscard]] double size_mm() const { return size_mm_; }  ///< median of the views' sizes

 private:
  [[nodiscard]] std::vector<ViewFitCheck> search(std::size_t view1, std::size_t view2) const;
  [[nodiscard]] ViewFitCheck check(std::size_t view1, std::size_t view2, const Transform& motion, int level,
                                   double reach) const;
  void align_near(std::size_t view1, std::size_t view2, int level, double capture, ViewFitCheck& fit) const;
  void narrow(std::size_t view1, std::size_t view2, int level, double reach, std::size_t keep,
              std::vector<ViewFitCheck>& field) const;
  void measure_spread(std::span<const std::vector<ViewFitCheck>> fits);
  [[nodiscard]] bool fits(const Agreement& agreement, double condition) const;
  [[nodiscard]] std::span<const View> view(std::size_t v) const { return views_.subspan(v, 1); }

  std::span<const View> views_;
  ViewPairOptions options_;
  std::vector<MeasuredPose> measured_;
  std::vector<PointPairTable> tables_;
  double size_mm_ = 0.0;
  double max_median_mm_ = 0.0;  ///< of distances between surfaces that may be the same
  double spread_mm_ = 0.0;      ///< of distances between surfaces that are the same
  PoseGraphOptions graph_options_;
};

}  // namespace scanrig
