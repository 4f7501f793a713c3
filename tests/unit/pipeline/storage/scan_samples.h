#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/files.h"
#include "pipeline/storage/scan_folder.h"
#include "tests/own_folder.h"
#include "tests/unit/pipeline/storage/sample_files.h"

namespace scanrig::scan_samples {

/// A folder of its own for each test, removed afterwards.
class FolderTest : public ::testing::Test {
 protected:
  std::filesystem::path folder_ = own_folder();
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
};

inline std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << "the sample holds no " << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

/// Images of 64x48 whose content depends on `seed`.
inline RawView raw_view(int seed) {
  RawView raw{"BayerRG8", {}, {}, {}, {}};
  for (cv::Mat* image : {&raw.left_pattern, &raw.right_pattern, &raw.left_plain, &raw.right_plain}) {
    image->create(48, 64, CV_8UC1);
    ++seed;
    for (int r = 0; r < image->rows; ++r) {
      for (int c = 0; c < image->cols; ++c) image->at<uchar>(r, c) = static_cast<uchar>(r * 7 + c * 13 + seed * 31);
    }
  }
  return raw;
}

inline bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && std::equal(a.datastart, a.dataend, b.datastart);
}

}  // namespace scanrig::scan_samples
