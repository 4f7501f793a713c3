#pragma once

// Requirements on every StereoCamera. To test an implementation, derive a StereoCameraBench for it and write, in one
// source file of a test program: INSTANTIATE_TEST_SUITE_P(Name, StereoCameraCompliance, testing::Values(&make_bench));

#include <gtest/gtest.h>

#include <memory>
#include <opencv2/core.hpp>

#include "tests/component/camera/stereo_camera_bench.h"

namespace scanrig {

using MakeStereoCameraBench = std::unique_ptr<StereoCameraBench> (*)();
using CameraFault = StereoCameraBench::Fault;

class StereoCameraCompliance : public testing::TestWithParam<MakeStereoCameraBench> {
 protected:
  void SetUp() override {
    bench_ = GetParam()();
    if (!bench_) GTEST_SKIP() << "this bench cannot be set up here";
  }

  Deadline ample() { return Deadline::after(bench_->clock(), bench_->ample()); }
  Deadline within(Clock::Duration time) { return Deadline::after(bench_->clock(), time); }
  Result<void> arm() { return bench_->camera().arm(ample()); }
  Result<StereoFrame> collect() { return bench_->camera().collect(ample()); }

  /// Takes one exposure like the station.
  Result<StereoFrame> expose(std::uint64_t* number = nullptr) {
    if (auto armed = arm(); !armed) return pass_on(armed);
    const auto fired = bench_->fire();
    if (number) *number = fired;
    return collect();
  }
  void expect_shows(const StereoFrame& frame, std::uint64_t number) {
    EXPECT_EQ(bench_->number_in(frame.left).value_or(number), number);
    EXPECT_EQ(bench_->number_in(frame.right).value_or(number), number);
  }
  void expect_good_exposure() {
    std::uint64_t number = 0;
    const auto frame = expose(&number);
    ASSERT_TRUE(frame) << frame.error().message;
    expect_shows(*frame, number);
  }
  /// A faulty exposure is an error of this kind, and never returns its frames; the next one is good.
  void expect_named_and_redone(CameraFault fault, ErrorCode code) {
    expect_good_exposure();
    if (!bench_->spoil(fault)) GTEST_SKIP() << "this bench cannot spoil frames so";
    const auto retake_reasons = expose();
    ASSERT_FALSE(retake_reasons);
    EXPECT_EQ(retake_reasons.error().code, code) << retake_reasons.error().message;
    for (int i = 0; i < 3; ++i) expect_good_exposure();
  }

  std::unique_ptr<StereoCameraBench> bench_;
};

TEST_P(StereoCameraCompliance, OneEdgeIsOnePairOfTheRightSizeAndType) {
  std::uint64_t number = 0;
  const auto before = bench_->clock().now();
  const auto frame = expose(&number);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->left.size(), bench_->size());
  EXPECT_EQ(frame->right.size(), bench_->size());
  EXPECT_EQ(frame->left.type(), frame->format == PixelFormat::bgr8 ? CV_8UC3 : CV_8UC1);
  EXPECT_EQ(frame->right.type(), frame->left.type());
  EXPECT_EQ(frame->trigger, 1u);
  EXPECT_GE(frame->taken, before);
  EXPECT_LE(frame->taken, bench_->clock().now());
  expect_shows(*frame, number);
}

TEST_P(StereoCameraCompliance, EveryPairBelongsToItsOwnEdge) {
  for (int i = 0; i < 20; ++i) expect_good_exposure();
}

TEST_P(StereoCameraCompliance, ImagesAreTheCallersOwn) {
  const auto first = expose();
  ASSERT_TRUE(first) << first.error().message;
  const cv::Mat left = first->left.clone();
  for (int i = 0; i < 8; ++i) expect_good_exposure();
  EXPECT_EQ(cv::norm(left, first->left, cv::NORM_INF), 0.0);
}

TEST_P(StereoCameraCompliance, CollectingUnarmedIsAProtocolError) {
  const auto frame = collect();
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::protocol);
}

TEST_P(StereoCameraCompliance, OneArmIsOneCollect) {
  expect_good_exposure();
  const auto again = collect();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::protocol);
  expect_good_exposure();
}

TEST_P(StereoCameraCompliance, WithoutAnEdgeCollectIsATimeoutByItsDeadline) {
  ASSERT_TRUE(arm());
  const auto began = bench_->clock().now();
  const auto frame = bench_->camera().collect(within(std::chrono::milliseconds(80)));
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::timeout) << frame.error().message;
  EXPECT_LT(bench_->clock().now() - began, std::chrono::seconds(2));
  expect_good_exposure();
}

TEST_P(StereoCameraCompliance, AnEdgeFromBeforeArmingIsNeverTheAnswer) {
  expect_good_exposure();
  ASSERT_TRUE(arm());
  bench_->fire();
  ASSERT_TRUE(arm());
  const auto frame = bench_->camera().collect(within(std::chrono::milliseconds(80)));
  ASSERT_FALSE(frame);
  expect_good_exposure();
}

TEST_P(StereoCameraCompliance, BeingReadyDisturbsNothing) {
  for (int i = 0; i < 2; ++i) {
    const auto ready = bench_->camera().prepare(ample());
    ASSERT_TRUE(ready) << ready.error().message;
    expect_good_exposure();
  }
  ASSERT_TRUE(arm());
  ASSERT_TRUE(bench_->camera().prepare(ample()));
  bench_->fire();
  EXPECT_TRUE(collect()) << "prepare() spoils no exposure that is awaited";
}

TEST_P(StereoCameraCompliance, ALookNeedsNoEdgeAndSpoilsNoExposure) {
  for (int i = 0; i < 3; ++i) {
    const auto seen = bench_->camera().capture_preview(ample());
    if (!seen && seen.error().code == ErrorCode::unsupported) GTEST_SKIP() << seen.error().message;
    ASSERT_TRUE(seen) << seen.error().message;
    EXPECT_EQ(seen->left.size(), bench_->size());
    EXPECT_EQ(seen->right.size(), bench_->size());
  }
  ASSERT_FALSE(collect()) << "a look is no arm";
  for (int i = 0; i < 3; ++i) expect_good_exposure();
  ASSERT_TRUE(arm());
  ASSERT_TRUE(bench_->camera().capture_preview(ample()));
  const auto after = collect();
  ASSERT_FALSE(after);
  EXPECT_EQ(after.error().code, ErrorCode::protocol) << "a look ends what arm() began";
  expect_good_exposure();
}

TEST_P(StereoCameraCompliance, ALostFrameIsATimeout) { expect_named_and_redone(CameraFault::lost, ErrorCode::timeout); }
TEST_P(StereoCameraCompliance, ALateFrameIsATimeoutAndNeverTheNextAnswer) {
  expect_named_and_redone(CameraFault::late, ErrorCode::timeout);
}
TEST_P(StereoCameraCompliance, ATornFrameIsAProtocolError) {
  expect_named_and_redone(CameraFault::torn, ErrorCode::protocol);
}
TEST_P(StereoCameraCompliance, AnOlderFrameIsAProtocolError) {
  expect_named_and_redone(CameraFault::stale, ErrorCode::protocol);
}

TEST_P(StereoCameraCompliance, AnUnpluggedCameraIsAnErrorAndComesBack) {
  expect_good_exposure();
  if (!bench_->plug(false)) GTEST_SKIP() << "this bench cannot be unplugged";
  EXPECT_FALSE(expose());
  const auto noticed = [&] { return !bench_->camera().prepare(ample()); };
  for (const auto by = ample(); !noticed() && !by.expired(bench_->clock());) {
    bench_->clock().sleep_for(std::chrono::milliseconds(20));
  }
  const auto armed = arm();
  ASSERT_FALSE(armed);
  EXPECT_TRUE(armed.error().code == ErrorCode::io || armed.error().code == ErrorCode::timeout ||
              armed.error().code == ErrorCode::not_found)
      << armed.error().message;
  ASSERT_TRUE(bench_->plug(true));
  expect_good_exposure();
}

}  // namespace scanrig
