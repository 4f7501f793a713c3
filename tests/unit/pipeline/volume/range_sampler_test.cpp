#include "pipeline/volume/range_sampler.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/pipeline/volume/analytic_rig.h"

namespace scanrig::test {
namespace {

RangeSampler::PartSource part_of(const RangeImage& range) {
  return [&range](const cv::Rect& box) {
    RangeImage part;
    part.depth = range.depth(box);
    part.sigma = range.sigma(box);
    part.normal = range.normal(box);
    if (!range.background.empty()) part.background = range.background(box);
    return part;
  };
}

void expect_same(const RangeSample& a, const RangeSample& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.clearly_free, b.clearly_free);
  EXPECT_EQ(a.distance, b.distance);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.normal, b.normal);
}

/// Specks, pinholes and edges all over: whatever is prepared depends on what is around it.
TEST(RangeSampler, InFocusASampleHasTheBitsOfTheWholeImage) {
  std::vector<View> views = take_views({.views = 3, .noise_mm = 0.02}, cast_into(rod({-10, 5, 0}, {12, 50, 3}, 9)));
  std::mt19937 random(7);
  std::uniform_real_distribution<float> share(0.0F, 1.0F);
  for (View& view : views) {
    for (float& depth : view.range.depth) depth = share(random) < 0.03F ? kUnmeasured : depth;
    RangeSampler whole(view.range, Transform::Identity(), 1.5, 0.5, {});
    RangeSampler focused = whole;
    for (int place = 0; place < 12; ++place) {
      const Eigen::Vector3f low(-20.0F + 30.0F * share(random), 55.0F * share(random), -12.0F + 15.0F * share(random));
      const Eigen::AlignedBox3f box(low, low + Eigen::Vector3f(9.0F, 7.0F, 8.0F));
      focused.focus(box, part_of(view.range));
      for (int i = 0; i < 4000; ++i) {
        const Eigen::Vector3f at(share(random), share(random), share(random));
        const Eigen::Vector3f point = box.min() + at.cwiseProduct(box.sizes());
        expect_same(focused.sample(point), whole.sample(point));
      }
    }
  }
}

}  // namespace
}  // namespace scanrig::test
