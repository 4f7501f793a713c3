// A rectified or calibrated pair of anybody's cameras, measured.
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/image_codec.h"
#include "core/signal_stop.h"
#include "core/statistics.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/range/rectification.h"
#include "pipeline/range/stereo.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;

constexpr double kMinMatched = 0.01;  // share of the left image's pixels: less is no pair

struct Grey {
  cv::Mat1f left, right;  // 0..255
};

Result<cv::Mat> read_image(const fs::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  auto image = decode_camera_image(*bytes);
  if (!image) return pass_on(image, file.string());
  return image;
}

/// Colour is weighted 1:2:1 as in rectified_grey().
cv::Mat1f to_grey(const cv::Mat& image, double scale) {
  cv::Mat grey;
  image.convertTo(grey, CV_MAKETYPE(CV_32F, image.channels()), scale);
  if (grey.channels() == 3) cv::transform(grey, grey, cv::Matx13f(0.25F, 0.5F, 0.25F));
  return grey;
}

/// 10 or 12 bits often lie in 16: both images' largest value tells how many are used.
double scale_of(const cv::Mat& left, const cv::Mat& right) {
  double most = 0.0;
  for (const cv::Mat* image : {&left, &right}) {
    if (image->depth() == CV_8U) continue;
    double max = 0.0;
    cv::minMaxLoc(image->reshape(1), nullptr, &max);
    most = std::max(most, max);
  }
  if (most == 0.0) return 1.0;
  double full = 255.0;
  while (full < most) full = 2.0 * full + 1.0;
  return 255.0 / full;
}

Result<Grey> read_pair(const RangeVerb& verb) {
  const auto left = read_image(verb.left), right = read_image(verb.right);
  if (!left) return pass_on(left);
  if (!right) return pass_on(right);
  if (left->size() != right->size()) {
    return fail(ErrorCode::invalid_input, "{} has {}x{} pixels, {} has {}x{}; give two images of one pair",
                verb.left.string(), left->cols, left->rows, verb.right.string(), right->cols, right->rows);
  }
  if (left->depth() != right->depth()) {
    return fail(ErrorCode::invalid_input, "{} and {} have 8 and 16 bits; give two images of one pair",
                verb.left.string(), verb.right.string());
  }
  const double scale = scale_of(*left, *right);
  Grey pair{to_grey(*left, scale), to_grey(*right, scale)};
  if (cv::norm(pair.left, pair.right, cv::NORM_INF) == 0.0) {
    return fail(ErrorCode::invalid_input, "{} and {} are the same image; give the left and the right one of a pair",
                verb.left.string(), verb.right.string());
  }
  return pair;
}

Result<RectifiedPair> as_given(const RangeVerb& verb, const Grey& images) {
  if (!(verb.focal_px > 0.0) || !(verb.baseline_mm > 0.0)) {
    return fail(ErrorCode::invalid_input, "a rectified pair needs --focal and --baseline, or give --calibration");
  }
  const cv::Size size = images.left.size();
  RectifiedPair pair;
  pair.left = images.left, pair.right = images.right;
  Projection& p = pair.left_projection;
  p = {Projection::Kind::pinhole, size.width, size.height, verb.focal_px, verb.focal_px, (size.width - 1) / 2.0,
       (size.height - 1) / 2.0};
  if (verb.centre.size() == 2) p.cx = verb.centre[0], p.cy = verb.centre[1];
  pair.right_cx = p.cx;
  pair.baseline_mm = verb.baseline_mm;
  pair.min_disparity = 0, pair.max_disparity = size.width / 4;
  return pair;
}

Result<RectifiedPair> by_calibration(const RangeVerb& verb, const Grey& images) {
  std::error_code ignored;
  const fs::path& from = verb.calibration;
  const auto calibration = read_calibration(fs::is_directory(from, ignored) ? from / "calibration.json" : from);
  if (!calibration) return pass_on(calibration);
  const Projection& p = calibration->left.projection;
  if (images.left.size() != cv::Size(p.width, p.height)) {
    return fail(ErrorCode::invalid_input,
                "{} is of cameras with {}x{} pixels, the images have {}x{}; give the calibration of these cameras",
                from.string(), p.width, p.height, images.left.cols, images.left.rows);
  }
  const auto r = rectify(*calibration);
  if (!r) return pass_on(r, from.string());
  const auto left = rectified_grey(r->left_map, images.left), right = rectified_grey(r->right_map, images.right);
  if (!left) return pass_on(left);
  if (!right) return pass_on(right);
  return RectifiedPair{*left, *right, {}, {}, r->left, r->right.cx, r->baseline_mm, r->min_disparity, r->max_disparity};
}

Result<RectifiedPair> rectified_pair(const RangeVerb& verb, const Grey& images) {
  auto pair = verb.rectified ? as_given(verb, images) : by_calibration(verb, images);
  if (!pair) return pair;
  if (verb.disparities.size() == 2) {
    pair->min_disparity = verb.disparities[0], pair->max_disparity = verb.disparities[1];
    if (pair->min_disparity >= pair->max_disparity || pair->max_disparity - pair->min_disparity > pair->left.cols) {
      return fail(ErrorCode::invalid_input, "--disparities {} {}: give the lowest, then the highest, in pixels",
                  pair->min_disparity, pair->max_disparity);
    }
  }
  return pair;
}

double matched_share(const Result<RangeImage>& range) {
  if (!range) return 0.0;
  return cv::countNonZero(range->depth == range->depth) / static_cast<double>(range->depth.total());
}

Result<RangeImage> measure(const RectifiedPair& pair, const Context& context) {
  auto range = match_rectified(pair, {}, context);
  if (!range && range.error().code != ErrorCode::degenerate) return range;
  if (matched_share(range) >= kMinMatched) return range;
  RectifiedPair exchanged = pair;
  std::swap(exchanged.left, exchanged.right);
  if (matched_share(match_rectified(exchanged, {}, context)) >= kMinMatched) {
    return fail(ErrorCode::invalid_input, "the images match only the other way round; give the left one first");
  }
  return fail(ErrorCode::degenerate,
              "the images show no common surface; check that they are one pair of one moment, its calibration and "
              "--disparities");
}

cv::Mat1f disparity_of(const RangeImage& range, const RectifiedPair& pair) {
  cv::Mat1f out(range.depth.size());
  const double strength = range.projection.fx * pair.baseline_mm, shift = range.projection.cx - pair.right_cx;
  std::transform(range.depth.begin(), range.depth.end(), out.begin(),
                 [&](float z) { return static_cast<float>(strength / static_cast<double>(z) + shift); });
  return out;
}

/// Disparity in colours over the darkened left image.
cv::Mat3b colours_of(const cv::Mat1f& disparity, const cv::Mat1f& left) {
  std::vector<double> known;
  std::copy_if(disparity.begin(), disparity.end(), std::back_inserter(known), [](float d) { return std::isfinite(d); });
  const double low = quantile(known, 0.02), high = std::max(quantile(known, 0.98), low + 1.0);
  cv::Mat1b levels(disparity.size(), std::uint8_t{0});
  cv::Mat3b colours, out(disparity.size());
  for (int v = 0; v < levels.rows; ++v) {
    for (int u = 0; u < levels.cols; ++u) {
      if (std::isnan(disparity(v, u))) continue;
      levels(v, u) = cv::saturate_cast<std::uint8_t>(255.0 * (double(disparity(v, u)) - low) / (high - low));
    }
  }
  cv::applyColorMap(levels, colours, cv::COLORMAP_TURBO);
  for (int v = 0; v < levels.rows; ++v) {
    for (int u = 0; u < levels.cols; ++u) {
      const auto grey = cv::saturate_cast<std::uint8_t>(0.5F * left(v, u));
      out(v, u) = std::isnan(disparity(v, u)) ? cv::Vec3b(grey, grey, grey) : colours(v, u);
    }
  }
  return out;
}

/// All files or none.
Result<void> write(const fs::path& out, const RangeImage& range, const cv::Mat1f& disparity, const cv::Mat1f& left) {
  const auto depth = encode_tiff(range.depth), sigma = encode_tiff(range.sigma), shift = encode_tiff(disparity);
  const auto colours = encode_png(colours_of(disparity, left));
  for (const auto* bytes : {&depth, &sigma, &shift, &colours}) {
    if (!*bytes) return pass_on(*bytes);
  }
  fs::path prepared = out;
  prepared += ".new";
  std::error_code ignored;
  fs::remove_all(prepared, ignored);
  Result<void> done = create_directories_synced(prepared);
  const std::array<FileContent, 4> files{
      {{"disparity.tiff", *shift}, {"depth.tiff", *depth}, {"sigma.tiff", *sigma}, {"colours.png", *colours}}};
  if (done) done = write_files_synced(prepared, files);
  if (done) done = replace_folder(prepared, out);
  if (!done) fs::remove_all(prepared, ignored);
  return done;
}

void print_range(const RangeVerb& verb, const RangeImage& range) {
  std::vector<double> depths, sigmas;
  for (int v = 0; v < range.depth.rows; ++v) {
    for (int u = 0; u < range.depth.cols; ++u) {
      if (std::isnan(range.depth(v, u))) continue;
      depths.push_back(double(range.depth(v, u)));
      sigmas.push_back(double(range.sigma(v, u)));
    }
  }
  const double measured = static_cast<double>(depths.size()) / static_cast<double>(range.depth.total());
  const double near = quantile(depths, 0.02), far = quantile(depths, 0.98), sigma = quantile(sigmas, 0.5);
  const std::string warning = row_warning(range.row_offsets);
  if (verb.json) {
    nlohmann::ordered_json json{{"out", verb.out},   {"measured", measured},     {"near_mm", near},
                                {"far_mm", far},     {"sigma_median_mm", sigma}, {"rows_px", nullptr},
                                {"warning", nullptr}};
    if (range.row_offsets.windows > 0) json["rows_px"] = range.row_offsets.largest_px;
    if (!warning.empty()) json["warning"] = as_sentence(warning);
    fmt::print("{}\n", json.dump());
    return;
  }
  fmt::print("measured {:.1f} % of the left image, {:.4g} to {:.4g} mm away, sigma {:.2g} mm (median)\n",
             100.0 * measured, near, far, sigma);
  if (!warning.empty()) fmt::print(stderr, "{}\n", as_sentence(warning));
  fmt::print("{}\n", verb.out.string());
}

}  // namespace

ExitCode range(const RangeVerb& verb) {
  std::error_code ignored;
  if (fs::exists(verb.out, ignored)) {
    return report_error({ErrorCode::exists, verb.out.string() + ": already there; name another folder with --out"});
  }
  if (verb.rectified != verb.calibration.empty()) {
    return report_error({ErrorCode::invalid_input, "range: give either --calibration or --rectified"});
  }
  const SignalStop stop;
  const auto done = catch_exceptions("range", [&]() -> Result<RangeImage> {
    const auto images = read_pair(verb);
    if (!images) return pass_on(images);
    const auto pair = rectified_pair(verb, *images);
    if (!pair) return pass_on(pair);
    auto range = measure(*pair, {stop.token(), {}});
    if (!range) return range;
    if (const auto written = write(verb.out, *range, disparity_of(*range, *pair), pair->left); !written) {
      return pass_on(written);
    }
    return range;
  });
  if (!done) return report_error(done.error());
  print_range(verb, *done);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
