#include "drivers/camera/image_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace scanrig {
namespace {

const cv::Size kSize{64, 48};

TEST(ImageMemory, OfAnImageNobodyHasAnyMoreServesTheNextOfItsSize) {
  cv::Mat image = new_image(kSize, CV_8U);
  const auto* first = image.data;
  image.release();
  EXPECT_NE(new_image({64, 47}, CV_8U).data, first) << "another size";
  EXPECT_EQ(new_image(kSize, CV_8U).data, first);
}

TEST(ImageMemory, IsNobodyElsesAsLongAsAnyoneHasThePicture) {
  cv::Mat image = new_image(kSize, CV_8U);
  image.setTo(7);
  const cv::Mat part = image.rowRange(10, 20);
  const auto* first = image.data;
  image.release();
  cv::Mat other = new_image(kSize, CV_8U);
  EXPECT_NE(other.data, first);
  other.setTo(9);
  EXPECT_EQ(part.at<std::uint8_t>(5, 5), 7);
}

TEST(ImageMemory, LetGoOnAnotherThreadServesAgain) {
  cv::Mat image = new_image(kSize, CV_8U);
  const auto* first = image.data;
  std::thread([there = std::move(image)]() mutable { there.release(); }).join();
  EXPECT_EQ(new_image(kSize, CV_8U).data, first);
}

TEST(ImageMemory, ACopyHasItsOwnEvenOfAPart) {
  cv::Mat image = new_image(kSize, CV_8UC3);
  image.setTo(cv::Scalar(1, 2, 3));
  const cv::Mat copy = copy_of(image.colRange(32, 64));
  image.setTo(0);
  ASSERT_EQ(copy.size(), cv::Size(32, 48));
  EXPECT_TRUE(copy.isContinuous());
  EXPECT_EQ(copy.at<cv::Vec3b>(47, 31), cv::Vec3b(1, 2, 3));
}

TEST(ImageMemory, KeepsNoMoreThanItSays) {
  std::vector<cv::Mat> images(2 * kImagesKept);
  std::ranges::generate(images, [] { return new_image(kSize, CV_8U); });
  const auto *first = images.front().data, *last = images.back().data;
  images.clear();  // from the front
  std::vector<cv::Mat> again(kImagesKept);
  std::ranges::generate(again, [] { return new_image(kSize, CV_8U); });
  const auto has = [&](const std::uint8_t* data) {
    return std::ranges::any_of(again, [&](const cv::Mat& image) { return image.data == data; });
  };
  EXPECT_TRUE(has(last));
  EXPECT_FALSE(has(first)) << "given back";
}

}  // namespace
}  // namespace scanrig
