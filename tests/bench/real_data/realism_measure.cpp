#include "tests/bench/real_data/realism_measure.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files.h"

namespace scanrig::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kWindow = 9;

Result<cv::Mat> read_image(const fs::path& file, int flags) {
  const cv::Mat image = cv::imread(file.string(), flags);
  if (image.empty()) return fail(ErrorCode::not_found, "{}: not an image; give another folder", file.string());
  return image;
}

Result<RealPair> real_pair(const fs::path& folder, const std::array<const char*, 2>& files, const std::string& name,
                           bool is_pattern) {
  const auto l = read_image(folder / files[0], cv::IMREAD_GRAYSCALE),
             r = read_image(folder / files[1], cv::IMREAD_GRAYSCALE);
  if (!l) return pass_on(l);
  if (!r) return pass_on(r);
  RealPair pair;
  pair.name = name, pair.is_pattern = is_pattern;
  pair.disparities = is_pattern ? 128 : 64;
  l->convertTo(pair.left, CV_32F);
  r->convertTo(pair.right, CV_32F);
  pair.mask = cv::Mat(l->size(), CV_8U, cv::Scalar(255));
  return pair;
}

struct Sensor {
  cv::Matx33d k, rotation;
  cv::Vec3d translation;
  std::vector<double> distortion;
};

Sensor sensor_of(const json& j) {
  Sensor s;
  s.k = {j["fx"], 0, j["cx"], 0, j["fy"], j["cy"], 0, 0, 1};
  s.distortion = j["distortion"].get<std::vector<double>>();
  const json& pose = j["camera_from_turntable"];
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < 3; ++c) s.rotation(i, c) = pose["rotation"][i][c];
    s.translation[i] = pose["translation"][i];
  }
  return s;
}

/// Maps of both images to rectified ones, and the disparity of the aim point.
struct Rectified {
  std::array<cv::Mat, 4> maps;
  int disparity = 0;
};

Rectified rectify(const json& calibration, const cv::Size& size) {
  const std::array<Sensor, 2> s = {sensor_of(calibration["left"]), sensor_of(calibration["right"])};
  const cv::Matx33d rotation = s[1].rotation * s[0].rotation.t();
  const cv::Vec3d translation = s[1].translation - rotation * s[0].translation;
  cv::Mat r[2], p[2], q;
  cv::stereoRectify(s[0].k, s[0].distortion, s[1].k, s[1].distortion, size, rotation, translation, r[0], r[1], p[0],
                    p[1], q, 0, 1.0, size);
  Rectified out;
  double column[2];
  for (int i = 0; i < 2; ++i) {
    cv::initUndistortRectifyMap(s[i].k, s[i].distortion, r[i], p[i], size, CV_32F, out.maps[2 * i],
                                out.maps[2 * i + 1]);
    const cv::Vec3d aim = s[i].rotation * cv::Vec3d(0.0, 45.0, 0.0) + s[i].translation;
    const cv::Mat at = p[i].colRange(0, 3) * (r[i] * cv::Mat(aim));
    column[i] = at.at<double>(0) / at.at<double>(2);
  }
  out.disparity = static_cast<int>(std::lround(column[0] - column[1]));
  return out;
}

/// Demosaiced grey, and where the part is: what is not as blue as the screen.
Result<cv::Mat> colours(const fs::path& file) {
  auto raw = read_image(file, cv::IMREAD_GRAYSCALE);
  if (!raw) return raw;
  cv::Mat colour;
  cv::cvtColor(*raw, colour, cv::COLOR_BayerBG2BGR);  // OpenCV's name for RGGB
  colour.convertTo(colour, CV_32F);
  return colour;
}

Result<RealPair> rendered_pair(const fs::path& scan, const std::string& name, bool is_pattern) {
  const auto text = read_file(scan / "truth_calibration.json");
  if (!text) return pass_on(text);
  const fs::path view = scan / "pose1" / "view00";
  RealPair pair;
  pair.name = name, pair.is_pattern = is_pattern;
  const auto plain = colours(view / "left_plain.png");
  if (!plain) return pass_on(plain);
  const Rectified rectified = rectify(json::parse(*text), plain->size());
  pair.min_disparity = rectified.disparity - 96, pair.disparities = 192;
  for (const int side : {0, 1}) {
    const auto colour =
        colours(view / fmt::format("{}_{}.png", side == 0 ? "left" : "right", is_pattern ? "pattern" : "plain"));
    if (!colour) return pass_on(colour);
    cv::Mat grey, straight;
    cv::cvtColor(*colour, grey, cv::COLOR_BGR2GRAY);
    cv::remap(grey, straight, rectified.maps[2 * side], rectified.maps[2 * side + 1], cv::INTER_CUBIC);
    (side == 0 ? pair.left : pair.right) = straight;
  }
  std::array<cv::Mat, 3> bgr;
  cv::Mat smooth;
  cv::GaussianBlur(*plain, smooth, {}, 2.0);
  cv::split(smooth, bgr);
  cv::Mat part = bgr[0] < 1.3 * cv::max(bgr[1], bgr[2]);
  cv::erode(part, part, cv::Mat::ones(9, 9, CV_8U));
  cv::remap(part, pair.mask, rectified.maps[0], rectified.maps[1], cv::INTER_NEAREST);
  return pair;
}

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

cv::Mat mean_of(const cv::Mat& image, int side) {
  cv::Mat mean;
  cv::blur(image, mean, {side, side}, {-1, -1}, cv::BORDER_REFLECT_101);
  return mean;
}

void measure_detail(const RealPair& pair, PairMeasure& m) {
  const cv::Mat mean = mean_of(pair.left, 15);
  cv::Mat variance = mean_of(pair.left.mul(pair.left), 15) - mean.mul(mean), sharp;
  // Immerkaer 1996: a difference of two Laplacians, which neither planes nor edges excite much.
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1);
  cv::filter2D(pair.left, sharp, CV_32F, kernel);
  const cv::Mat rough = mean_of(cv::abs(sharp), 15);
  std::vector<double> contrast, noise;
  for (int y = 8; y + 8 < mean.rows; y += 4) {
    for (int x = 8; x + 8 < mean.cols; x += 4) {
      const double level = mean.at<float>(y, x);
      if (pair.mask.at<uchar>(y, x) == 0 || level < 3.0) continue;
      contrast.push_back(std::sqrt(std::max(0.0F, variance.at<float>(y, x))) / level);
      noise.push_back(std::sqrt(CV_PI / 2.0) / 6.0 * rough.at<float>(y, x) / level);
    }
  }
  m.contrast = percentile(contrast, 0.5);
  m.noise = percentile(noise, 0.05);
}

void measure_autocorrelation(const RealPair& pair, PairMeasure& m) {
  const cv::Mat high = pair.left - mean_of(pair.left, 31);
  std::array<double, 7> sums{};
  for (int y = 16; y + 16 < high.rows; ++y) {
    for (int x = 16; x + 16 < high.cols; ++x) {
      if (pair.mask.at<uchar>(y, x) == 0) continue;
      for (int lag = 0; lag < 7; ++lag) sums[lag] += high.at<float>(y, x) * high.at<float>(y, x + lag);
    }
  }
  for (int lag = 1; lag < 7; ++lag) m.autocorrelation[lag - 1] = sums[lag] / sums[0];
}

cv::Mat stretched(const cv::Mat& image, double factor) {
  cv::Mat eight;
  image.convertTo(eight, CV_8U, factor);
  return eight;
}

/// Correlation of two windows; the right one between its pixels.
double zncc(const RealPair& pair, int x, int y, double disparity) {
  constexpr int kHalf = kWindow / 2;
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (int j = -kHalf; j <= kHalf; ++j) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      const double at = x + i - disparity;
      const int left = static_cast<int>(std::floor(at));
      const double share = at - left;
      const auto* row = pair.right.ptr<float>(y + j);
      const double p = pair.left.at<float>(y + j, x + i), q = (1.0 - share) * row[left] + share * row[left + 1];
      a += p, b += q, aa += p * p, bb += q * q, ab += p * q;
    }
  }
  const double n = kWindow * kWindow;
  return (ab - a * b / n) / std::sqrt(std::max(1e-12, (aa - a * a / n) * (bb - b * b / n)));
}

void measure_likeness(const RealPair& pair, PairMeasure& m) {
  std::vector<double> levels;
  for (int y = 0; y < pair.left.rows; y += 5)
    for (int x = 0; x < pair.left.cols; x += 5)
      if (pair.mask.at<uchar>(y, x)) levels.push_back(pair.left.at<float>(y, x));
  const double factor = 200.0 / std::max(1.0, percentile(levels, 0.98));
  cv::Mat disparity;
  cv::StereoSGBM::create(pair.min_disparity, pair.disparities, kWindow, 8 * kWindow * kWindow, 32 * kWindow * kWindow,
                         1, 0, 5, 100, 2, cv::StereoSGBM::MODE_SGBM_3WAY)
      ->compute(stretched(pair.left, factor), stretched(pair.right, factor), disparity);
  std::vector<double> values;
  for (int y = 8; y + 8 < disparity.rows; y += 3) {
    for (int x = 8; x + 8 < disparity.cols; x += 3) {
      const double d = disparity.at<short>(y, x) / 16.0;
      if (pair.mask.at<uchar>(y, x) == 0 || d < pair.min_disparity || x - d < 8.0 || x - d > pair.right.cols - 9.0)
        continue;
      values.push_back(zncc(pair, x, y, d));
    }
  }
  m.windows = static_cast<int>(values.size());
  for (const double value : values)
    m.zncc_shares[std::clamp(static_cast<int>(std::floor((value - 0.45) / 0.05)), 0, 9)] += 1.0 / m.windows;
  m.zncc_p10 = percentile(values, 0.1), m.zncc_p50 = percentile(values, 0.5), m.zncc_p90 = percentile(values, 0.9);
}

}  // namespace

Result<std::vector<RealPair>> read_pairs(const fs::path& data, const RenderedScans& scans) {
  const fs::path sets = data / "middlebury_stereo" / "datasets";
  std::vector<RealPair> pairs;
  for (const auto& pair :
       {real_pair(data / "d415_ir_pair", {"image0.png", "image1.png"}, "D415", true),
        rendered_pair(scans.faint_dots, "faint dots", true), rendered_pair(scans.workshop, "workshop", true),
        rendered_pair(scans.laboratory, "laboratory", true),
        real_pair(sets / "teddy", {"im2.png", "im6.png"}, "teddy", false),
        real_pair(sets / "cones", {"im2.png", "im6.png"}, "cones", false),
        rendered_pair(scans.workshop, "workshop plain", false),
        rendered_pair(scans.laboratory, "laboratory plain", false)}) {
    if (!pair) return pass_on(pair);
    pairs.push_back(*pair);
  }
  return pairs;
}

PairMeasure measure(const RealPair& pair) {
  PairMeasure m;
  measure_detail(pair, m);
  measure_autocorrelation(pair, m);
  measure_likeness(pair, m);
  return m;
}

}  // namespace scanrig::bench
