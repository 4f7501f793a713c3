#pragma once

// Requirements on every Projector. To test an implementation, derive a ProjectorBench for it and write, in one source
// file of a test program: INSTANTIATE_TEST_SUITE_P(Name, ProjectorCompliance, testing::Values(&make_bench));

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "drivers/projector/projector.h"

namespace scanrig {

/// A projector on the bench, as an onlooker and the cameras see it.
class ProjectorBench {
 public:
  struct Flash {
    Light light;
    Clock::TimePoint at;
  };
  virtual ~ProjectorBench() = default;
  virtual Projector& projector() = 0;
  virtual Clock& clock() = 0;
  /// Trigger edges so far and the light of each.
  virtual std::vector<Flash> seen() = 0;
  virtual bool seen_lit() = 0;
  /// Runs `act`, once, when it is next lit, from another thread or before fire() can return.
  virtual void when_lit(std::function<void()> act) = 0;
  [[nodiscard]] virtual Clock::Duration exposure() const = 0;
  /// Cuts the connection, and restores it.
  virtual void plug(bool in) = 0;
};

using MakeProjectorBench = std::unique_ptr<ProjectorBench> (*)();

class ProjectorCompliance : public testing::TestWithParam<MakeProjectorBench> {
 protected:
  std::unique_ptr<ProjectorBench> bench_ = GetParam()();

  Deadline ample() { return Deadline::after(bench_->clock(), std::chrono::seconds(5)); }
  Result<void> fire(Light light) { return bench_->projector().fire(light, ample()); }
};

TEST_P(ProjectorCompliance, OneFireIsOneExposureInTheLightAskedForAndDarkAfterwards) {
  for (const Light light : {Light::pattern, Light::plain, Light::plain, Light::pattern}) {
    const std::size_t before = bench_->seen().size();
    const auto fired = fire(light);
    ASSERT_TRUE(fired) << fired.error().message;
    EXPECT_FALSE(bench_->seen_lit());
    const auto seen = bench_->seen();
    ASSERT_EQ(seen.size(), before + 1);
    EXPECT_EQ(seen.back().light, light);
    EXPECT_GE(bench_->clock().now() - seen.back().at, bench_->exposure());
  }
}

TEST_P(ProjectorCompliance, AnExposureThatDoesNotFitIsATimeoutAndNotBegun) {
  ASSERT_TRUE(fire(Light::pattern));
  const std::size_t before = bench_->seen().size();
  const auto fired = bench_->projector().fire(Light::pattern, Deadline::after(bench_->clock(), bench_->exposure() / 2));
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::timeout) << fired.error().message;
  EXPECT_EQ(bench_->seen().size(), before);
}

TEST_P(ProjectorCompliance, AnotherThreadEndsTheLight) {
  ASSERT_TRUE(fire(Light::pattern));
  bench_->when_lit([&] { bench_->projector().request_off(); });
  const auto fired = fire(Light::pattern);
  ASSERT_FALSE(fired);
  EXPECT_EQ(fired.error().code, ErrorCode::io) << fired.error().message;
  EXPECT_FALSE(bench_->seen_lit());
  const auto again = fire(Light::pattern);
  EXPECT_TRUE(again) << again.error().message;
}

TEST_P(ProjectorCompliance, DarkIsDark) {
  const auto dark = bench_->projector().turn_off(ample());
  ASSERT_TRUE(dark) << dark.error().message;
  EXPECT_FALSE(bench_->seen_lit());
}

TEST_P(ProjectorCompliance, ALostProjectorIsAnErrorThatSaysTheLightMayBeOn) {
  ASSERT_TRUE(fire(Light::pattern));
  bench_->plug(false);
  EXPECT_FALSE(fire(Light::pattern));
  const auto dark = bench_->projector().turn_off(ample());
  ASSERT_FALSE(dark);
  EXPECT_NE(dark.error().message.find("light may be on"), std::string::npos) << dark.error().message;
}

}  // namespace scanrig
