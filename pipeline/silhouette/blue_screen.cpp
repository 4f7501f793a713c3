#include "pipeline/silhouette/blue_screen.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "pipeline/exposures/merge_exposures.h"
#include "pipeline/silhouette/box_around.h"
#include "pipeline/silhouette/contour_distance.h"

namespace scanrig {
namespace {

constexpr int kRoomPx = 40;  // around the object: more than the windows around its edge

/// What the border shows: the channel that is strongest there, and its share of the light.
struct Screen {
  int channel = 0;
  double share = 0.0;  ///< 0: the border is dark
};

float light_of(const cv::Vec3f& colour) { return colour[0] + colour[1] + colour[2]; }

/// Whether a pixel has less than a share of the screen's chroma: 0 is grey, 1 the screen.
class LessThanScreen {
 public:
  LessThanScreen(const Screen& screen, double share)
      : channel_(screen.channel), limit_(static_cast<float>(1.0 / 3.0 + share * (screen.share - 1.0 / 3.0))) {}
  bool operator()(const cv::Vec3f& colour) const {
    // Dark pixels are drawn towards grey by less than one grey level per channel.
    return colour[channel_] + 1.0f < limit_ * (light_of(colour) + 3.0f);
  }

 private:
  int channel_;
  float limit_;  ///< of the channel's share of the light
};

float median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Calls visit(x, y) for the pixels within `border` px of the image's edge.
template <class Visit>
void for_border(cv::Size size, int border, const Visit& visit) {
  for (int y = 0; y < size.height; ++y) {
    const bool whole_row = y < border || y >= size.height - border;
    for (int x = 0; x < size.width; ++x) {
      if (!whole_row && x == border) x = size.width - border;
      visit(x, y);
    }
  }
}

/// Medians along the image's border.
Screen screen_at_border(const cv::Mat3f& image, const BlueScreenOptions& options) {
  std::array<std::vector<float>, 3> shares;
  for_border(image.size(), options.border_px, [&](int x, int y) {
    const cv::Vec3f& c = image(y, x);
    const float sum = light_of(c);
    if (!(sum > options.dark_level)) return;
    for (int k = 0; k < 3; ++k) shares[static_cast<std::size_t>(k)].push_back(c[k] / sum);
  });
  Screen screen;
  if (shares[0].size() < static_cast<std::size_t>(image.cols)) return screen;
  for (int k = 0; k < 3; ++k) {
    const auto share = static_cast<double>(median_of(shares[static_cast<std::size_t>(k)]));
    if (share > screen.share) screen = {k, share};
  }
  return screen;
}

/// Clears parts smaller than `smallest(pixels of the largest)`; how large that is.
template <class Smallest>
int remove_small_parts(cv::Mat1b& mask, int connectivity, const Smallest& smallest) {
  cv::Mat1i labels;
  cv::Mat stats, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, connectivity, CV_32S);
  int largest = 0;
  for (int i = 1; i < count; ++i) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  std::vector<std::uint8_t> kept(static_cast<std::size_t>(count), 0);
  for (int i = 1; i < count; ++i) {
    kept[static_cast<std::size_t>(i)] = stats.at<int>(i, cv::CC_STAT_AREA) >= smallest(largest) ? 255 : 0;
  }
  for (int y = 0; y < mask.rows; ++y) {
    const int* label = labels[y];
    uchar* out = mask[y];
    for (int x = 0; x < mask.cols; ++x) out[x] = kept[static_cast<std::size_t>(label[x])];
  }
  return largest;
}

void remove_parts(cv::Mat1b& mask, double smallest, int connectivity) {
  remove_small_parts(mask, connectivity, [smallest](int) { return smallest; });
}

cv::Mat3f smoothed(const cv::Mat& image) {
  cv::Mat3f smooth;
  cv::boxFilter(image, smooth, CV_32F, {3, 3}, {-1, -1}, true, cv::BORDER_REPLICATE);
  if (image.depth() == CV_16U) smooth *= 1.0 / kMergedUnitsPerGrey;
  return smooth;
}

/// The brightness up to which the pattern image's chroma is noise. Plain light shows the screen at the border; where
/// the pattern image has another chroma there, it is dark and noisy, for the projector does not reach everywhere.
float noise_level(const cv::Mat3f& pattern, const LessThanScreen& is_object, const cv::Mat1b& object,
                  const BlueScreenOptions& options) {
  std::vector<float> wrong;
  for_border(pattern.size(), options.border_px, [&](int x, int y) {
    const float light = light_of(pattern(y, x));
    const bool is_lit = is_object(pattern(y, x)) && light > options.dark_level;
    if (is_lit && object(y, x) == 0) wrong.push_back(light);
  });
  if (wrong.empty()) return options.dark_level;
  const auto high = wrong.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(wrong.size() - 1));
  std::nth_element(wrong.begin(), high, wrong.end());
  return *high;
}

/// What the projector lights and what has not the screen's chroma then, gaps of the pattern included. Less than that at
/// its edge, where pixels are mixed. `object`: what has another chroma than the screen in plain light.
cv::Mat1b lit_object(const cv::Mat3f& smooth, const Screen& screen, const cv::Mat1b& object,
                     const BlueScreenOptions& options) {
  const LessThanScreen is_object(screen, options.lit_key);
  const float dark = noise_level(smooth, is_object, object, options);
  cv::Mat1b lit(smooth.size());
  for (int y = 0; y < lit.rows; ++y) {
    const cv::Vec3f* colour = smooth[y];
    uchar* out = lit[y];
    for (int x = 0; x < lit.cols; ++x) {
      const bool is_lit = is_object(colour[x]) & (light_of(colour[x]) > dark);
      out[x] = is_lit ? 255 : 0;
    }
  }
  remove_parts(lit, options.min_hole_px, 8);
  const cv::Mat band = cv::getStructuringElement(cv::MORPH_ELLIPSE, {options.mixed_band_px, options.mixed_band_px});
  cv::morphologyEx(lit, lit, cv::MORPH_CLOSE, band);
  cv::erode(lit, lit, cv::Mat());
  return lit;
}

/// The colour of the pixels in `mask` around each pixel; those away from the mask's edge have priority.
cv::Mat3f colour_around(const cv::Mat3f& image, const cv::Mat1b& mask, const BlueScreenOptions& options) {
  cv::Mat1b core;
  cv::erode(mask, core, cv::getStructuringElement(cv::MORPH_ELLIPSE, {options.mixed_band_px, options.mixed_band_px}));
  cv::Mat1f weight(mask.size());
  cv::Mat3f weighted(mask.size());
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      weight(y, x) = core(y, x) != 0 ? 1.0f : mask(y, x) != 0 ? 1e-3f : 0.0f;
      weighted(y, x) = image(y, x) * weight(y, x);
    }
  }
  const cv::Size window(options.colour_window_px, options.colour_window_px);
  cv::boxFilter(weighted, weighted, CV_32F, window, {-1, -1}, false);
  cv::boxFilter(weight, weight, CV_32F, window, {-1, -1}, false);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) weighted(y, x) *= 1.0f / std::max(weight(y, x), 1e-4f);
  }
  return weighted;
}

/// 1/2 - alpha, alpha the object's share in a pixel's light. Only a pixel near the mask's edge can be mixed; its light
/// is compared there with the object's and the screen's colour nearby.
cv::Mat1f outside_share_within(const cv::Mat3f& image, const cv::Mat1b& object, const BlueScreenOptions& options) {
  const cv::Mat1b screen(255 - object);
  const cv::Mat3f object_colour = colour_around(image, object, options);
  const cv::Mat3f screen_colour = colour_around(image, screen, options);
  cv::Mat1b grown, shrunk;
  const cv::Mat band = cv::getStructuringElement(cv::MORPH_ELLIPSE, {options.mixed_band_px, options.mixed_band_px});
  cv::dilate(object, grown, band);
  cv::erode(object, shrunk, band);
  cv::Mat1f field(image.size());
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      field(y, x) = object(y, x) != 0 ? -0.5f : 0.5f;
      if (grown(y, x) == 0 || shrunk(y, x) != 0) continue;
      const cv::Vec3f contrast = object_colour(y, x) - screen_colour(y, x);
      const float square = contrast.dot(contrast);
      if (square < options.min_contrast) continue;  // too similar to separate a mixture
      const float alpha = (image(y, x) - screen_colour(y, x)).dot(contrast) / square;
      field(y, x) = 0.5f - std::clamp(alpha, 0.0f, 1.0f);
    }
  }
  return field;
}

/// The same of a whole image: beyond the colours around the object all of it is screen.
cv::Mat1f outside_share(const cv::Mat& image, const cv::Mat1b& object, const BlueScreenOptions& options) {
  const int margin = options.colour_window_px + options.mixed_band_px;
  const cv::Rect box = box_around(object, margin);
  cv::Mat1f field(object.size(), 0.5f);
  if (box.empty()) return field;
  cv::Mat3f colour;
  image(box).convertTo(colour, CV_32F);
  outside_share_within(colour, object(box), options).copyTo(field(box));
  return field;
}

bool touches_border(const cv::Mat1b& mask) {
  const int right = mask.cols - 2, bottom = mask.rows - 2;
  return cv::countNonZero(mask.rowRange(0, 2)) + cv::countNonZero(mask.rowRange(bottom, mask.rows)) +
             cv::countNonZero(mask.colRange(0, 2)) + cv::countNonZero(mask.colRange(right, mask.cols)) >
         0;
}

}  // namespace

cv::Mat1f outline_near(const cv::Mat& image, const cv::Mat1b& mask, const cv::Mat1b& surely_object,
                       const BlueScreenOptions& options) {
  cv::Mat1f field = outside_share(image, mask, options);
  field.setTo(-0.5f, surely_object);
  return contour_distance(field);
}

Result<cv::Mat1f> blue_screen_outline(const cv::Mat& image, const cv::Mat& pattern, const BlueScreenOptions& options) {
  if (image.type() != CV_8UC3 || image.cols < 4 * options.border_px || image.rows < 4 * options.border_px) {
    return fail(ErrorCode::invalid_input, "silhouette: a screen needs a colour image (BGR, 8 bit) of {} px or more",
                4 * options.border_px);
  }
  if (!pattern.empty() && (pattern.size() != image.size() || pattern.channels() != 3)) {
    return fail(ErrorCode::invalid_input, "silhouette: the images of both lights differ in size or channels");
  }
  const cv::Mat3f smooth = smoothed(image);
  const Screen screen_colour = screen_at_border(smooth, options);
  if (screen_colour.share == 0.0) {
    return fail(ErrorCode::degenerate,
                "silhouette: the border of the image is dark; check that the screen is in place and lit");
  }
  if (screen_colour.share < options.min_key_share) {
    return fail(ErrorCode::not_found,
                "silhouette: the border of the image has no colour of its own ({:.0f} % of its light in one channel); "
                "check that the blue or green screen is in place",
                100.0 * screen_colour.share);
  }
  const LessThanScreen is_object(screen_colour, options.object_key);
  cv::Mat1b object(smooth.size());
  for (int y = 0; y < object.rows; ++y) {
    const cv::Vec3f* colour = smooth[y];
    uchar* out = object[y];
    for (int x = 0; x < object.cols; ++x) out[x] = is_object(colour[x]) ? 255 : 0;
  }
  if (!pattern.empty()) object |= lit_object(smoothed(pattern), screen_colour, object, options);
  const int largest = remove_small_parts(
      object, 8, [&](int part) { return std::max<double>(options.min_hole_px, options.min_part_share * part); });
  if (largest < options.min_hole_px) {
    return fail(ErrorCode::not_found, "silhouette: no object before the screen; check that the object is on the table");
  }
  if (touches_border(object)) {
    return fail(ErrorCode::out_of_range,
                "silhouette: the object reaches the border of the image, it is larger than the working volume");
  }
  // Only around the object is anything to be found.
  const cv::Rect box = box_around(object, kRoomPx);
  cv::Mat1b part(object, box), screen(255 - part);
  remove_parts(screen, options.min_hole_px, 4);
  part = 255 - screen;
  const cv::Mat1f outside = contour_distance(outside_share(image(box), part, options));
  return distance_beyond(outside, cv::Rect({-box.x, -box.y}, image.size()));
}

}  // namespace scanrig
