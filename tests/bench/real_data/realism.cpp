// bench_realism DATA LABORATORY WORKSHOP FAINT IMAGE [SCAN...]: how rendered pairs compare with real ones, as JSON;
// see realism_measure.h. DATA: the folder of real pairs. The scans are of `scanrig-sim shoot`, one view is enough.
// IMAGE: a JPEG of crops side by side, written anew; each further SCAN adds its first view in colour.

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/bench/real_data/realism_measure.h"

namespace {

using scanrig::bench::PairMeasure;
using scanrig::bench::RealPair;

std::string json(const PairMeasure& m) {
  std::string lags, shares;
  for (const double value : m.autocorrelation) lags += fmt::format("{}{:.3f}", lags.empty() ? "" : ", ", value);
  for (const double value : m.zncc_shares) shares += fmt::format("{}{:.4f}", shares.empty() ? "" : ", ", value);
  return fmt::format(
      R"({{"contrast": {:.3f}, "noise": {:.4f}, "autocorrelation": [{}], "zncc_p10": {:.3f}, "zncc_p50": {:.3f}, )"
      R"("zncc_p90": {:.3f}, "zncc_shares": [{}], "windows": {}}})",
      m.contrast, m.noise, lags, m.zncc_p10, m.zncc_p50, m.zncc_p90, shares, m.windows);
}

constexpr int kSide = 200;

cv::Mat labelled(cv::Mat image, const std::string& name) {
  cv::putText(image, name, {5, kSide - 7}, cv::FONT_HERSHEY_SIMPLEX, 0.45, {0, 255, 255}, 1, cv::LINE_AA);
  cv::copyMakeBorder(image, image, 0, 4, 0, 4, cv::BORDER_CONSTANT, {255, 255, 255});
  return image;
}

/// The first view of a scan, as large as a crop, as a screen shows it.
cv::Mat whole(const std::filesystem::path& scan) {
  cv::Mat colour;
  cv::cvtColor(cv::imread(scan / "pose1/view00/left_plain.png", cv::IMREAD_GRAYSCALE), colour, cv::COLOR_BayerBG2BGR);
  const int side = std::min(colour.cols, colour.rows);
  colour = colour(cv::Rect((colour.cols - side) / 2, 0, side, side));
  colour.convertTo(colour, CV_32F, 1.0 / 255.0);
  cv::resize(colour, colour, {kSide, kSide}, 0, 0, cv::INTER_AREA);
  cv::pow(colour, 1.0 / 2.2, colour);
  colour.convertTo(colour, CV_8U, 255.0);
  return labelled(colour, scan.filename().string());
}

/// The middle of what is measured, stretched to the same brightness as the others.
cv::Mat crop(const RealPair& pair) {
  const cv::Moments m = cv::moments(pair.mask, true);
  const int x = std::clamp(static_cast<int>(m.m10 / m.m00) - kSide / 2, 0, pair.left.cols - kSide),
            y = std::clamp(static_cast<int>(m.m01 / m.m00) - kSide / 2, 0, pair.left.rows - kSide);
  cv::Mat grey;
  pair.left(cv::Rect(x, y, kSide, kSide)).convertTo(grey, CV_32F);
  grey = grey * (0.25 / cv::mean(grey)[0]);
  cv::pow(cv::min(grey, 1.0), 1.0 / 2.2, grey);
  grey.convertTo(grey, CV_8U, 255.0);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  return labelled(grey, pair.name);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    fmt::print(stderr, "usage: bench_realism DATA LABORATORY WORKSHOP FAINT IMAGE [SCAN...]\n");
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  const auto pairs = scanrig::bench::read_pairs(argv[1], {argv[2], argv[3], argv[4]});
  if (!pairs) {
    fmt::print(stderr, "bench_realism: {}\n", pairs.error().message);
    return static_cast<int>(scanrig::exit_code(pairs.error().code));
  }
  std::string text;
  std::vector<cv::Mat> rows(3);
  const auto add = [&rows](std::size_t row, const cv::Mat& image) {
    rows[row].empty() ? image.copyTo(rows[row]) : cv::hconcat(rows[row], image, rows[row]);
  };
  for (const RealPair& pair : *pairs) {
    text += fmt::format("{}\"{}\": {}", text.empty() ? "" : ",\n ", pair.name, json(scanrig::bench::measure(pair)));
    add(pair.is_pattern ? 0 : 1, crop(pair));
  }
  for (int i = 6; i < argc; ++i) add(2, whole(argv[i]));
  if (rows[2].empty()) rows.pop_back();
  int width = 0;
  for (const cv::Mat& row : rows) width = std::max(width, row.cols);
  for (cv::Mat& row : rows)
    cv::copyMakeBorder(row, row, 0, 0, 0, width - row.cols, cv::BORDER_CONSTANT, {255, 255, 255});
  cv::vconcat(rows, rows[0]);
  if (!cv::imwrite(argv[5], rows[0], {cv::IMWRITE_JPEG_QUALITY, 85})) {
    fmt::print(stderr, "bench_realism: {}: cannot be written; name another file\n", argv[5]);
    return static_cast<int>(scanrig::ExitCode::disk);
  }
  fmt::print("{{{}}}\n", text);
  return 0;
}
