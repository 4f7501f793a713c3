#include <array>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/image_codec.h"
#include "tests/system/daemon/programs.h"
#include "tests/unit/pipeline/storage/sample_files.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

constexpr int kShift = 20;  // px
const cv::Size kSize(400, 300);

/// A random pattern, and the same kShift px further left: a plane.
class RangeVerb : public Programs {
 protected:
  void SetUp() override {
    Programs::SetUp();
    cv::RNG random(7);
    cv::Mat1f dots(kSize.height, kSize.width + kShift);
    random.fill(dots, cv::RNG::UNIFORM, 0.0, 255.0);
    cv::GaussianBlur(dots, dots, {}, 1.3);
    cv::normalize(dots, dots, 0.0, 255.0, cv::NORM_MINMAX);
    dots.convertTo(scene_, CV_8U);
    left_ = put("left.png", noisy(scene_.colRange(0, kSize.width), 8));
    right_ = put("right.png", noisy(scene_.colRange(kShift, kShift + kSize.width), 9));
  }
  static cv::Mat noisy(const cv::Mat& image, std::uint64_t seed) {
    cv::Mat1f noise(image.size());
    cv::RNG(seed).fill(noise, cv::RNG::NORMAL, 0.0, 1.0);
    cv::Mat1f values;
    image.convertTo(values, CV_32F);
    cv::Mat1b result;
    cv::Mat1f(values + noise).convertTo(result, CV_8U);
    return result;
  }
  std::string put(const std::string& name, const cv::Mat& image) const {
    EXPECT_TRUE(write_file_atomically(folder_ / name, *encode_png(image.clone())));
    return folder_ / name;
  }
  int range(const std::string& left, const std::string& right, std::vector<std::string> more) {
    more.insert(more.begin(), {"range", left, right, "--out", folder_ / "out"});
    return scanrig(more);
  }
  void expect_refused(int code, int wanted, const std::string& sentence) const {
    EXPECT_EQ(code, wanted) << output;
    EXPECT_THAT(output, HasSubstr(sentence));
    EXPECT_EQ(std::ranges::count(output, '\n'), 1) << output;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }

  const std::vector<std::string> lens_ = {"--rectified", "--focal", "1000", "--baseline", "50"};
  cv::Mat1b scene_;
  std::string left_, right_;
};

TEST_F(RangeVerb, MeasuresARectifiedPair) {
  ASSERT_EQ(range(left_, right_, lens_), 0) << output;
  EXPECT_THAT(output, HasSubstr("measured "));
  const auto read = [&](const char* name) {
    return decode_tiff(*read_file(folder_ / "out" / name)).value_or(cv::Mat());
  };
  const cv::Mat1f disparity = read("disparity.tiff"), depth = read("depth.tiff"), sigma = read("sigma.tiff");
  ASSERT_EQ(disparity.size(), kSize);
  EXPECT_NEAR(disparity(150, 200), kShift, 0.02);
  EXPECT_NEAR(depth(150, 200), 1000.0 * 50.0 / kShift, 2.0);
  EXPECT_GT(sigma(150, 200), 0.0F);
  EXPECT_TRUE(std::isnan(disparity(150, 2)));  // only the left image shows it
  EXPECT_EQ(decode_png(*read_file(folder_ / "out" / "colours.png"))->size(), kSize);
}

TEST_F(RangeVerb, SaysInOneSentenceWhatIsWrong) {
  const std::string small = put("small.png", scene_(cv::Rect(0, 0, 200, 300)));
  const std::string text = folder_ / "text.png";
  ASSERT_TRUE(write_file_atomically(text, "no image"));
  cv::Mat1b other(kSize);
  cv::RNG(8).fill(other, cv::RNG::UNIFORM, 0, 255);
  const std::string foreign = put("foreign.png", other);
  expect_refused(range(folder_ / "nowhere.png", right_, lens_), 3, "nowhere.png");
  expect_refused(range(text, right_, lens_), 3, "text.png: not a PNG or TIFF image");
  expect_refused(range(left_, small, lens_), 3, "small.png has 200x300; give two images of one pair");
  expect_refused(range(left_, left_, lens_), 3, "are the same image");
  expect_refused(range(right_, left_, lens_), 3, "the other way round");
  expect_refused(range(left_, foreign, lens_), 7, "no common surface");
  expect_refused(range(left_, right_, {"--rectified", "--focal", "1000"}), 3, "--focal and --baseline");
  expect_refused(range(left_, right_, {}), 3, "either --calibration or --rectified");
  expect_refused(range(left_, right_, {"--calibration", folder_ / "none.json"}), 3, "none.json");
  auto narrow = lens_;
  narrow.insert(narrow.end(), {"--disparities", "30", "10"});
  expect_refused(range(left_, right_, narrow), 3, "--disparities 30 10");
}

TEST_F(RangeVerb, RowsTooFarOffRefuseTheCalibration) {
  cv::Mat1b lower = scene_.clone();
  scene_.rowRange(0, kSize.height - 5).copyTo(lower.rowRange(5, kSize.height));
  const std::string moved = put("moved.png", lower.colRange(kShift, kShift + kSize.width));
  expect_refused(range(left_, moved, lens_), 6, "rows of the right camera");
}

TEST_F(RangeVerb, ACalibrationOfOtherCamerasIsRefused) {
  ASSERT_TRUE(write_file_atomically(folder_ / "calibration.json", scan_samples::calibration_json()));
  expect_refused(range(left_, right_, {"--calibration", folder_ / "calibration.json"}), 3,
                 "give the calibration of these cameras");
}

TEST_F(RangeVerb, OverwritesNothing) {
  std::filesystem::create_directory(folder_ / "out");
  EXPECT_EQ(range(left_, right_, lens_), 3);
  EXPECT_THAT(output, HasSubstr("already there"));
}

}  // namespace
}  // namespace scanrig
