#include "core/image_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

namespace scanrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

cv::Mat noise(int type, cv::Size size = {61, 47}) {
  cv::Mat image(size, type);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

cv::Mat smooth() {
  cv::Mat image(48, 64, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) image.at<cv::Vec3b>(y, x) = cv::Vec3b(cv::Vec3i(3 * x, 4 * y, 120));
  }
  return image;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0;
}

std::string_view text(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// The image that another program reads from the bytes.
cv::Mat read_elsewhere(const std::vector<std::byte>& bytes) {
  const std::string_view file = as_text(bytes);
  return cv::imdecode(std::vector<char>(file.begin(), file.end()), cv::IMREAD_UNCHANGED);
}

Bytes written_elsewhere(const char* extension, const cv::Mat& image, const std::vector<int>& options = {}) {
  Bytes bytes;
  cv::imencode(extension, image, bytes, options);
  return bytes;
}

TEST(Png, WhatIsWrittenIsReadHereAndElsewhere) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    const cv::Mat image = noise(type);
    const auto bytes = encode_png(image);
    ASSERT_TRUE(bytes) << bytes.error().message;
    EXPECT_TRUE(same(decode_png(as_text(*bytes)).value(), image));
    EXPECT_TRUE(same(read_elsewhere(*bytes), image));
    EXPECT_TRUE(same(decode_image(text(written_elsewhere(".png", image))).value(), image));
  }
}

TEST(Png, APartOfAnImageIsWritten) {
  const cv::Mat part = noise(CV_8UC3)(cv::Rect(5, 7, 20, 30));
  EXPECT_TRUE(same(decode_png(as_text(encode_png(part).value())).value(), part));
}

TEST(Png, UnsupportedImagesAreRefused) {
  for (const cv::Mat& image : {cv::Mat(), noise(CV_16UC1), noise(CV_8UC4), noise(CV_32FC1)}) {
    EXPECT_EQ(encode_png(image).error().code, ErrorCode::invalid_input);
  }
}

TEST(Png, SixteenBitsAndAlphaAreRefused) {
  for (const int type : {CV_16UC1, CV_16UC3, CV_8UC4}) {
    EXPECT_EQ(decode_png(text(written_elsewhere(".png", noise(type)))).error().code, ErrorCode::invalid_input);
  }
}

TEST(Png, CutAnywhereIsRefused) {
  const auto bytes = encode_png(noise(CV_8UC1)).value();
  const std::string_view whole = as_text(bytes);
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 2) {
    EXPECT_FALSE(decode_image(whole.substr(0, length))) << length;
  }
  EXPECT_FALSE(decode_image(whole.substr(0, whole.size() - 1)));
}

TEST(Png, AChangedBitIsNoticed) {
  const auto bytes = encode_png(noise(CV_8UC1)).value();
  std::string changed(as_text(bytes));
  for (const std::size_t at : {std::size_t{20}, changed.size() / 2, changed.size() - 6}) {
    changed[at] ^= 1;
    EXPECT_FALSE(decode_png(changed)) << at;
    changed[at] ^= 1;
  }
  EXPECT_TRUE(decode_png(changed));
}

TEST(Jpeg, LooksAlikeHereAndElsewhere) {
  const cv::Mat image = smooth();
  const auto bytes = encode_jpeg(image, 95);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const double most = 8.0 * static_cast<double>(image.total());
  EXPECT_LT(cv::norm(decode_jpeg(as_text(*bytes)).value(), image, cv::NORM_L1), most);
  EXPECT_LT(cv::norm(read_elsewhere(*bytes), image, cv::NORM_L1), most);
  const auto grey = decode_jpeg(as_text(encode_jpeg(cv::Mat1b(8, 8, uchar{90}), 90).value()));
  EXPECT_EQ(grey->type(), CV_8UC3);
  EXPECT_NEAR(grey->at<cv::Vec3b>(3, 3)[0], 90, 2);
}

TEST(Jpeg, UnsupportedImagesAreRefused) {
  EXPECT_EQ(encode_jpeg(cv::Mat(), 90).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(encode_jpeg(noise(CV_16UC1), 90).error().code, ErrorCode::invalid_input);
}

TEST(Jpeg, AFrameOfMotionJpegWithoutHuffmanTablesIsRead) {
  const Bytes whole = written_elsewhere(".jpg", smooth());
  Bytes without(whole.begin(), whole.begin() + 2);
  std::size_t at = 2;
  while (whole[at + 1] != 0xDA) {  // segments until the scan begins: marker, then the length that counts itself
    const std::size_t length = 2 + (whole[at + 2] << 8 | whole[at + 3]);
    if (whole[at + 1] != 0xC4) without.insert(without.end(), whole.begin() + at, whole.begin() + at + length);
    at += length;
  }
  without.insert(without.end(), whole.begin() + at, whole.end());
  ASSERT_LT(without.size(), whole.size());
  EXPECT_TRUE(same(decode_jpeg(text(without)).value(), decode_jpeg(text(whole)).value()));
}

TEST(Jpeg, CutAnywhereIsRefusedAndPaddingIsNot) {
  Bytes bytes = written_elsewhere(".jpg", noise(CV_8UC3));
  for (std::size_t length = 0; length < bytes.size() - 2; length += 1 + length / 2) {
    EXPECT_FALSE(decode_jpeg(text(bytes).substr(0, length))) << length;
  }
  EXPECT_FALSE(decode_jpeg(text(bytes).substr(0, bytes.size() - 40)));
  bytes.resize(bytes.size() + 100);
  EXPECT_TRUE(decode_jpeg(text(bytes)));
}

TEST(Tiff, DepthIsKeptBitByBit) {
  cv::Mat1f depth(11, 7);
  cv::RNG random(3);
  random.fill(depth, cv::RNG::UNIFORM, -900.0, 900.0);
  depth(4, 4) = std::numeric_limits<float>::quiet_NaN();
  const auto bytes = encode_tiff(depth).value();
  for (const cv::Mat& read : {decode_image(as_text(bytes)).value(), read_elsewhere(bytes)}) {
    ASSERT_EQ(read.type(), CV_32FC1);
    ASSERT_EQ(read.size(), depth.size());
    EXPECT_TRUE(std::isnan(read.at<float>(4, 4)));
    EXPECT_EQ(std::memcmp(read.data, depth.data, depth.total() * sizeof(float)), 0);
  }
  const Bytes elsewhere = written_elsewhere(".tiff", depth, {cv::IMWRITE_TIFF_COMPRESSION, 5});  // LZW
  EXPECT_EQ(std::memcmp(decode_tiff(text(elsewhere))->data, depth.data, depth.total() * sizeof(float)), 0);
}

TEST(Tiff, OtherKindsAndCutOnesAreRefused) {
  EXPECT_EQ(encode_tiff({}).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(decode_tiff(text(written_elsewhere(".tiff", noise(CV_8UC1)))).error().code, ErrorCode::invalid_input);
  const auto bytes = encode_tiff(cv::Mat1f(40, 30, 2.5F)).value();
  const std::string_view whole = as_text(bytes);
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 2) {
    EXPECT_FALSE(decode_tiff(whole.substr(0, length))) << length;
  }
}

TEST(DecodeImage, NoiseIsNotAnImage) {
  EXPECT_EQ(decode_image("certainly no image").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(decode_image("").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(decode_jpeg("certainly no image").error().code, ErrorCode::invalid_input);
}

TEST(CameraImage, GreyAndColourOf8And16BitsAreReadAsTheyAre) {
  for (const char* extension : {".png", ".tiff"}) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
      cv::Mat image = noise(type);
      if (image.depth() == CV_16U) image *= 251;
      const auto read = decode_camera_image(text(written_elsewhere(extension, image)));
      ASSERT_TRUE(read) << extension << " " << read.error().message;
      EXPECT_TRUE(same(*read, image)) << extension << " type " << type;
    }
  }
}

TEST(CameraImage, AlphaIsDropped) {
  const cv::Mat image = noise(CV_8UC4);
  const cv::Mat read = decode_camera_image(text(written_elsewhere(".png", image))).value();
  ASSERT_EQ(read.type(), CV_8UC3);
  EXPECT_EQ(read.at<cv::Vec3b>(5, 7)[1], image.at<cv::Vec4b>(5, 7)[1]);
}

TEST(CameraImage, WhatIsCutOrNoImageIsRefused) {
  const Bytes whole = written_elsewhere(".png", noise(CV_16UC1));
  EXPECT_EQ(decode_camera_image(text(whole).substr(0, whole.size() / 2)).error().code, ErrorCode::invalid_input);
  EXPECT_EQ(decode_camera_image("no image").error().code, ErrorCode::invalid_input);
  const cv::Mat depth(4, 4, CV_32FC1, cv::Scalar(1.0));
  EXPECT_EQ(decode_camera_image(text(written_elsewhere(".tiff", depth))).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace scanrig
