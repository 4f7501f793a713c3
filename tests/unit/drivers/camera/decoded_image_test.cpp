#include "drivers/camera/decoded_image.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace scanrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

RawImage raw(Layout layout, int bits, cv::Size size, const Bytes& bytes, std::size_t stride = 0) {
  return {layout, bits, size, stride, bytes};
}
DecodedImage decoded(const RawImage& image) {
  auto made = decode_image(image);
  EXPECT_TRUE(made) << made.error().message;
  return made ? std::move(*made) : DecodedImage{};
}

TEST(DecodedImage, Mono8IsAsItIs) {
  const Bytes bytes{1, 2, 3, 4, 5, 6};
  const auto made = decoded(raw(Layout::mono, 8, {3, 2}, bytes));
  EXPECT_EQ(made.format, PixelFormat::mono8);
  EXPECT_EQ(made.image.at<std::uint8_t>(1, 0), 4);
}

TEST(DecodedImage, PaddingAtTheEndOfRowsIsLeftOut) {
  const Bytes bytes{1, 2, 99, 99, 3, 4};
  const auto made = decoded(raw(Layout::mono, 8, {2, 2}, bytes, 4));
  EXPECT_EQ(made.image.at<std::uint8_t>(1, 0), 3);
}

TEST(DecodedImage, OfMoreBitsTheUpperEightRemain) {
  const Bytes ten{0xFF, 0x03, 0x00, 0x02};  // 1023, 512
  EXPECT_EQ(decoded(raw(Layout::mono, 10, {2, 1}, ten)).image.at<std::uint8_t>(0, 0), 255);
  EXPECT_EQ(decoded(raw(Layout::mono, 10, {2, 1}, ten)).image.at<std::uint8_t>(0, 1), 128);
  const Bytes twelve{0xF0, 0x0F};  // 4080
  EXPECT_EQ(decoded(raw(Layout::mono, 12, {1, 1}, twelve)).image.at<std::uint8_t>(0, 0), 255);
  const Bytes sixteen{0xFF, 0x7F};
  EXPECT_EQ(decoded(raw(Layout::mono, 16, {1, 1}, sixteen)).image.at<std::uint8_t>(0, 0), 127);
}

TEST(DecodedImage, BitsAboveTheSensorsOwnDoNotWrapRound) {
  const Bytes bytes{0xFF, 0xFF};
  EXPECT_EQ(decoded(raw(Layout::mono, 10, {1, 1}, bytes)).image.at<std::uint8_t>(0, 0), 255);
}

/// A mosaic of one colour, from the pattern's own definition: `at` names the colour of each of its four pixels.
Bytes mosaic(const char* at, cv::Size size, std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  Bytes bytes;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const char colour = at[y % 2 * 2 + x % 2];
      bytes.push_back(colour == 'R' ? red : colour == 'G' ? green : blue);
    }
  }
  return bytes;
}

TEST(DecodedImage, BayerRggbStaysAMosaicTheOthersBecomeColour) {
  const cv::Size size{8, 6};
  const auto kept = mosaic("RGGB", size, 200, 100, 50);
  EXPECT_EQ(decoded(raw(Layout::bayer_rg, 8, size, kept)).format, PixelFormat::bayer_rggb8);
  const std::pair<Layout, const char*> others[] = {
      {Layout::bayer_gr, "GRBG"}, {Layout::bayer_gb, "GBRG"}, {Layout::bayer_bg, "BGGR"}};
  for (const auto& [layout, at] : others) {
    const auto bytes = mosaic(at, size, 200, 100, 50);
    const auto made = decoded(raw(layout, 8, size, bytes));
    EXPECT_EQ(made.format, PixelFormat::bgr8);
    EXPECT_EQ(made.image.at<cv::Vec3b>(3, 4), cv::Vec3b(50, 100, 200)) << at;
  }
}

TEST(DecodedImage, RgbIsTurnedRound) {
  const Bytes bytes{10, 20, 30};
  EXPECT_EQ(decoded(raw(Layout::rgb, 8, {1, 1}, bytes)).image.at<cv::Vec3b>(0, 0), cv::Vec3b(30, 20, 10));
  EXPECT_EQ(decoded(raw(Layout::bgr, 8, {1, 1}, bytes)).image.at<cv::Vec3b>(0, 0), cv::Vec3b(10, 20, 30));
}

TEST(DecodedImage, YuyvOfGreyIsGrey) {
  const Bytes bytes{126, 128, 126, 128};  // half of the range of 16 to 235
  const auto pixel = decoded(raw(Layout::yuyv, 8, {2, 1}, bytes)).image.at<cv::Vec3b>(0, 1);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(pixel[i], 128, 2);
}

TEST(DecodedImage, JpegIsDecodedAndMustHaveTheSize) {
  Bytes bytes;
  cv::imencode(".jpg", cv::Mat(16, 24, CV_8UC3, cv::Scalar(40, 90, 160)), bytes);
  const auto made = decoded(raw(Layout::jpeg, 8, {24, 16}, bytes));
  EXPECT_EQ(made.format, PixelFormat::bgr8);
  EXPECT_NEAR(made.image.at<cv::Vec3b>(8, 8)[2], 160, 4);
  EXPECT_EQ(decode_image(raw(Layout::jpeg, 8, {16, 24}, bytes)).error().code, ErrorCode::protocol);
  bytes.resize(20);
  EXPECT_EQ(decode_image(raw(Layout::jpeg, 8, {24, 16}, bytes)).error().code, ErrorCode::protocol);
}

TEST(DecodedImage, TooFewBytesAreAProtocolError) {
  const Bytes bytes(11);
  EXPECT_EQ(decode_image(raw(Layout::mono, 8, {4, 3}, bytes)).error().code, ErrorCode::protocol);
  EXPECT_EQ(decode_image(raw(Layout::mono, 8, {0, 0}, bytes)).error().code, ErrorCode::protocol);
  EXPECT_EQ(decode_image(raw(Layout::mono, 8, {4, 2}, bytes, 3)).error().code, ErrorCode::protocol);
}

TEST(DecodedImage, SeventeenBitsAreUnsupported) {
  const Bytes bytes(24);
  EXPECT_EQ(decode_image(raw(Layout::mono, 17, {4, 3}, bytes)).error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace scanrig
