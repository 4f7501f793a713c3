#include "pipeline/range/coarse_disparity.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "pipeline/range/range_image.h"

namespace scanrig {
namespace {

/// Local contrast normalised to one level, 8 bit: shading and albedo are removed, the pattern stays.
cv::Mat1b flattened(const cv::Mat1f& image) {
  const cv::Size window(25, 25);
  cv::Mat1f mean, square, deviation;
  cv::boxFilter(image, mean, CV_32F, window, cv::Point(-1, -1), true, cv::BORDER_REPLICATE);
  cv::boxFilter(image.mul(image), square, CV_32F, window, cv::Point(-1, -1), true, cv::BORDER_REPLICATE);
  cv::sqrt(cv::max(square - mean.mul(mean), 0.0f), deviation);
  // Two grey levels of noise stay noise.
  const cv::Mat flat = 128.0f + 45.0f * (image - mean) / (deviation + 2.0f);
  cv::Mat1b out;
  flat.convertTo(out, CV_8U);
  return out;
}

cv::Mat1b widened(const cv::Mat1b& image, int margin) {
  cv::Mat1b out;
  cv::copyMakeBorder(image, out, 0, 0, margin, margin, cv::BORDER_REPLICATE);
  return out;
}

/// Disparities to search: lowest, and how many.
struct Search {
  int lowest = 0, count = 0;

  static Search between(int lowest, int highest) {
    return {lowest, std::max(16, (highest - lowest + 16) / 16 * 16)};  // OpenCV wants a multiple of 16
  }
};

/// `is_checked`: only disparities to which the right image's cheapest ones lead back within a pixel.
cv::Mat1f match(const cv::Mat1b& here, const cv::Mat1b& there, const Search& search, int speckle_px, bool is_checked) {
  constexpr int kBlock = 5;
  const auto matcher =
      cv::StereoSGBM::create(search.lowest, search.count, kBlock, 4 * kBlock * kBlock, 24 * kBlock * kBlock,
                             is_checked ? 1 : -1, 31, 3, speckle_px, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat1s fixed;
  matcher->compute(here, there, fixed);
  cv::Mat1f disparity(fixed.size());
  const short unknown = static_cast<short>((search.lowest - 1) * 16);
  for (int y = 0; y < fixed.rows; ++y) {
    for (int x = 0; x < fixed.cols; ++x) {
      disparity(y, x) = fixed(y, x) <= unknown ? kUnmeasured : static_cast<float>(fixed(y, x)) / 16.0f;
    }
  }
  return disparity;
}

cv::Mat1f flipped(const cv::Mat1f& image) {
  cv::Mat1f out;
  cv::flip(image, out, 1);
  return out;
}

/// Between two columns of a row; NaN for NaN.
float value_at(const float* row, int width, float x) {
  if (std::isnan(x)) return x;
  const float inside = std::clamp(x, 0.0F, static_cast<float>(width - 1));
  const int left = std::min(static_cast<int>(inside), width - 2);
  const float share = inside - static_cast<float>(left);
  return row[left] + share * (row[left + 1] - row[left]);
}

/// The left image's disparities at the right image's pixels: the nearest surface's where several meet, the mean of both
/// sides in gaps of a pixel.
cv::Mat1f seen_from_right(const cv::Mat1f& left) {
  constexpr float kSame = 2.0F;  // px: both sides of a gap are one surface
  cv::Mat1f right(left.size(), kUnmeasured);
  for (int y = 0; y < left.rows; ++y) {
    const float* from = left[y];
    float* to = right[y];
    for (int x = 0; x < left.cols; ++x) {
      if (std::isnan(from[x])) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(x) - from[x]));
      if (landing >= 0 && landing < left.cols && !(to[landing] >= from[x])) to[landing] = from[x];
    }
    for (int x = 1; x + 1 < left.cols; ++x) {
      if (std::isnan(to[x]) && std::abs(to[x - 1] - to[x + 1]) < kSame) to[x] = 0.5F * (to[x - 1] + to[x + 1]);
    }
  }
  return right;
}

/// Of two images of one size. `from_both`: each in its turn, for disparities that both confirm; else from the left.
CoarseDisparity match_both(const cv::Mat1b& left, const cv::Mat1b& right, const Search& search, int speckle_px,
                           bool from_both) {
  // OpenCV leaves out the columns whose search would leave the image.
  const int margin = std::max({std::abs(search.lowest), std::abs(search.lowest + search.count), 16});
  const cv::Mat1b a = widened(left, margin), b = widened(right, margin);
  if (!from_both) {
    const cv::Mat1f disparity = match(a, b, search, speckle_px, true).colRange(margin, margin + left.cols);
    return {disparity, seen_from_right(disparity)};
  }
  cv::Mat1b a_mirrored, b_mirrored;
  cv::flip(a, a_mirrored, 1);
  cv::flip(b, b_mirrored, 1);
  const cv::Range columns(margin, margin + left.cols);
  return {match(a, b, search, speckle_px, false).colRange(columns),
          flipped(match(b_mirrored, a_mirrored, search, speckle_px, false)).colRange(columns)};
}

/// A smooth surface near the disparities, and the residuals to search: a third as many, or fewer, as disparities occur.
struct Guide {
  cv::Mat1f base;
  Search residuals;
};

/// A quadratic through the disparities, each weighted by how well the one before fits.
cv::Mat1f smooth_surface(const cv::Mat1f& disparity, const cv::Mat1b& is_known) {
  constexpr int kRounds = 5, kTerms = 6, kStride = 2;
  constexpr float kNear = 4.0F;  // px
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  const auto terms = [size = disparity.size()](int x, int y) {
    const double u = 2.0 * x / size.width - 1.0, v = 2.0 * y / size.height - 1.0;
    return (Terms() << 1.0, u, v, u * u, u * v, v * v).finished();
  };
  Terms surface = Terms::Zero();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Identity() * 1e-3;
    Terms rhs = Terms::Zero();
    for (int y = 0; y < disparity.rows; y += kStride) {
      for (int x = 0; x < disparity.cols; x += kStride) {
        if (is_known(y, x) == 0) continue;
        const Terms t = terms(x, y);
        const double value = static_cast<double>(disparity(y, x)), off = value - surface.dot(t);
        const double weight = round == 0 ? 1.0 : 1.0 / std::max(1.0, std::abs(off) / static_cast<double>(kNear));
        normal += weight * t * t.transpose();
        rhs += weight * value * t;
      }
    }
    surface = normal.ldlt().solve(rhs);
  }
  cv::Mat1f out(disparity.size());
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.cols; ++x) out(y, x) = static_cast<float>(surface.dot(terms(x, y)));
  }
  return out;
}

/// A pixel x of the left image is seen at x - r in the right one moved by `base`; the residual r = d - base(x - r).
float residual_of(const float* base, int width, int x, float disparity) {
  constexpr int kRounds = 4;
  float residual = disparity - base[x];
  for (int round = 0; round < kRounds; ++round)
    residual = disparity - value_at(base, width, static_cast<float>(x) - residual);
  return residual;
}

/// All that occur, less the outliers that were smooth enough not to be taken for speckles.
Search residuals_to_search(const cv::Mat1f& base, const cv::Mat1f& disparity, const cv::Mat1b& is_known, float scale) {
  constexpr double kOutliers = 0.003;  // on each side
  constexpr int kMargin = 16;          // px
  std::vector<float> residual;
  for (int y = 0; y < base.rows; ++y) {
    for (int x = 0; x < base.cols; ++x) {
      if (is_known(y, x) != 0) residual.push_back(scale * residual_of(base[y], base.cols, x, disparity(y, x)));
    }
  }
  const auto quantile = [&](double share) {
    const auto place = residual.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(residual.size() - 1));
    std::nth_element(residual.begin(), place, residual.end());
    return *place;
  };
  const float least = quantile(kOutliers), most = quantile(1.0 - kOutliers);
  return Search::between(static_cast<int>(std::floor(least)) - kMargin, static_cast<int>(std::ceil(most)) + kMargin);
}

/// From images a quarter as large; none where too little is found there.
std::optional<Guide> guide_for(const cv::Mat1b& left, const cv::Mat1b& right, const cv::Mat1b& object,
                               const Search& search) {
  constexpr int kScale = 4, kSpeckle = 40, kFewest = 200;
  cv::Mat1b a, b, is_object, is_known;
  cv::resize(left, a, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
  cv::resize(right, b, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
  const Search small = Search::between(search.lowest / kScale - 1, (search.lowest + search.count) / kScale + 1);
  const CoarseDisparity both = match_both(a, b, small, kSpeckle, false);
  const cv::Mat1f found = confirmed(both.left, both.right, -1.0F, 1.0F);
  cv::resize(object, is_object, found.size(), 0.0, 0.0, cv::INTER_NEAREST);
  cv::compare(found, found, is_known, cv::CMP_EQ);  // not NaN
  is_known &= is_object;
  if (cv::countNonZero(is_known) < kFewest) return std::nullopt;
  const cv::Mat1f base = smooth_surface(found, is_known);
  Guide guide{{}, residuals_to_search(base, found, is_known, kScale)};
  cv::resize(base, guide.base, left.size(), 0.0, 0.0, cv::INTER_LINEAR);
  guide.base *= kScale;
  return guide;
}

/// Searches the residuals only, in the right image moved by the base.
CoarseDisparity match_guided(const cv::Mat1b& left, const cv::Mat1b& right, const Guide& guide, int speckle_px) {
  cv::Mat1f columns(left.size()), rows(left.size());
  for (int y = 0; y < left.rows; ++y) {
    for (int x = 0; x < left.cols; ++x) {
      columns(y, x) = static_cast<float>(x) - guide.base(y, x);
      rows(y, x) = static_cast<float>(y);
    }
  }
  cv::Mat1b moved;
  cv::remap(right, moved, columns, rows, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::Mat1f disparity = match_both(left, moved, guide.residuals, speckle_px, false).left;
  for (int y = 0; y < left.rows; ++y) {
    float* residual = disparity[y];
    for (int x = 0; x < left.cols; ++x) {
      residual[x] += value_at(guide.base[y], left.cols, static_cast<float>(x) - residual[x]);  // NaN stays
    }
  }
  return {disparity, seen_from_right(disparity)};
}

}  // namespace

CoarseDisparity coarse_disparity(const RectifiedPair& pair, const PairBoxes& boxes) {
  const cv::Mat1b left = flattened(pair.left(boxes.left)), right = flattened(pair.right(boxes.right));
  const int shift = boxes.shift();
  const Search search = Search::between(std::max(pair.min_disparity - shift, -left.cols),
                                        std::min(pair.max_disparity - shift, left.cols));
  // Masks leave no background to be matched wrongly, so one direction is enough.
  const bool has_masks = !pair.left_object.empty() && !pair.right_object.empty();
  const auto guide = has_masks ? guide_for(left, right, pair.left_object(boxes.left), search) : std::nullopt;
  constexpr int kSpeckle = 60;
  const CoarseDisparity within =
      guide ? match_guided(left, right, *guide, kSpeckle) : match_both(left, right, search, kSpeckle, !has_masks);
  const cv::Size size = pair.left.size();
  CoarseDisparity out{cv::Mat1f(size, kUnmeasured), cv::Mat1f(size, kUnmeasured)};
  cv::add(within.left, static_cast<double>(shift), out.left(boxes.left));
  cv::add(within.right, static_cast<double>(shift), out.right(boxes.right));
  return out;
}

cv::Mat1f confirmed(const cv::Mat1f& here, const cv::Mat1f& there, float towards, float tolerance_px) {
  cv::Mat1f out(here.size(), kUnmeasured);
  for (int v = 0; v < here.rows; ++v) {
    for (int u = 0; u < here.cols; ++u) {
      const float d = here(v, u);
      if (std::isnan(d)) continue;
      const int landing = static_cast<int>(std::lround(static_cast<float>(u) + towards * d));
      if (landing >= 0 && landing < here.cols && std::abs(there(v, landing) - d) <= tolerance_px) out(v, u) = d;
    }
  }
  return out;
}

}  // namespace scanrig
