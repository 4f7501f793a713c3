#include "pipeline/evaluate/texture_figures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/units.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/texture/render.h"

namespace scanrig {
namespace {

cv::Mat1f gradient_magnitude(const cv::Mat& image) {
  cv::Mat grey;
  if (image.channels() == 3) {
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  } else {
    grey = image;
  }
  cv::Mat1f smooth, dx, dy, magnitude;
  grey.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {0, 0}, 1.0);
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 0.125);
  cv::magnitude(dx, dy, magnitude);
  return magnitude;
}

/// Place of the peak between three values, -0.5..0.5.
double vertex(double before, double peak, double after) {
  const double bend = before - 2.0 * peak + after;
  return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

/// NaN for a patch without a clear match.
double offset_of(const cv::Mat1f& drawn, const cv::Mat1f& photo, const cv::Rect& patch,
                 const TextureFigureOptions& options) {
  const int reach = options.reach_px;
  cv::Scalar mean, deviation;
  cv::meanStdDev(drawn(patch), mean, deviation);
  if (deviation[0] < options.min_gradient) return std::nan("");
  const cv::Rect window(patch.x - reach, patch.y - reach, patch.width + 2 * reach, patch.height + 2 * reach);
  if ((window & cv::Rect({0, 0}, photo.size())) != window) return std::nan("");
  cv::Mat1f score;
  cv::matchTemplate(photo(window), drawn(patch), score, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point at;
  cv::minMaxLoc(score, nullptr, &best, nullptr, &at);
  const bool inside = at.x > 0 && at.y > 0 && at.x + 1 < score.cols && at.y + 1 < score.rows;
  if (best < options.min_correlation || !inside) return std::nan("");
  const double dx = at.x - reach + vertex(score(at.y, at.x - 1), best, score(at.y, at.x + 1));
  const double dy = at.y - reach + vertex(score(at.y - 1, at.x), best, score(at.y + 1, at.x));
  return std::hypot(dx, dy);
}

}  // namespace

std::vector<double> patch_offsets(const cv::Mat& drawn, const cv::Mat& photo, const cv::Mat1b& mask,
                                  const TextureFigureOptions& options) {
  const int erosion = options.erosion_px, side = options.patch_px;
  const cv::Mat1f drawn_gradient = gradient_magnitude(drawn), photo_gradient = gradient_magnitude(photo);
  cv::Mat1b eroded;
  cv::erode(mask, eroded, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * erosion + 1, 2 * erosion + 1}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, 0);
  std::vector<double> offsets;
  for (int y = 0; y + side <= mask.rows; y += side / 2) {
    for (int x = 0; x + side <= mask.cols; x += side / 2) {
      const cv::Rect patch(x, y, side, side);
      if (cv::countNonZero(eroded(patch)) < patch.area()) continue;
      const double offset = offset_of(drawn_gradient, photo_gradient, patch, options);
      if (!std::isnan(offset)) offsets.push_back(offset);
    }
  }
  return offsets;
}

Result<Scores::TextureFigures> texture_figures(const TexturedMesh& model, const Truth& truth, const ScanFolder& photos,
                                               const TextureFigureOptions& limits, const Context& context) {
  const auto renderer = MeshRenderer::create(model);
  if (!renderer) return pass_on(renderer);
  std::vector<double> offsets;
  for (std::size_t p = 0; p < std::min(truth.poses.size(), photos.manifest().poses.size()); ++p) {
    const TruePose& pose = truth.poses[p];
    for (std::size_t v = 0; v < std::min(pose.angles_deg.size(), photos.manifest().poses[p].views.size()); ++v) {
      if (context.stopped()) return fail(ErrorCode::stopped, "evaluation stopped");
      const auto photo = photos.load_usable_image(p, v, "left_plain");
      if (!photo) return pass_on(photo);
      RenderOptions options;
      options.supersample = 2;
      const auto drawn =
          renderer->render(truth.left, rot_y(to_radians(pose.angles_deg[v])) * pose.table_from_truth, options);
      if (!drawn) return pass_on(drawn);
      const auto found = patch_offsets(drawn->image, *photo, drawn->mask, limits);
      offsets.insert(offsets.end(), found.begin(), found.end());
    }
  }
  return Scores::TextureFigures{offsets.size(), quantile(offsets, 0.5), quantile(offsets, 0.95)};
}

}  // namespace scanrig
