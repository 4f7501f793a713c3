#include "sim/scene/image_sensor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/parallel.h"
#include "sim/scene/random.h"

namespace scanrig::sim {
namespace {

enum class PixelRandom : std::uint8_t { gain = 80, column, hot, black };

}  // namespace

cv::Mat through_lens(const cv::Mat& light, double image_scale, double extra_sigma_px, double sigma_px) {
  cv::Mat blurred;
  const double sigma = std::hypot(sigma_px, extra_sigma_px) * image_scale;
  cv::GaussianBlur(light, blurred, {}, sigma, sigma, cv::BORDER_REPLICATE);
  cv::Mat filtered(light.rows, light.cols, CV_32F);
  for (int y = 0; y < light.rows; ++y) {
    const auto* in = blurred.ptr<cv::Vec3f>(y);
    auto* out = filtered.ptr<float>(y);
    for (int x = 0; x < light.cols; ++x) out[x] = in[x][(x & 1) + (y & 1)];  // red, green or blue filter
  }
  return filtered;
}

cv::Mat ImageSensor::cross_talked(const cv::Mat& on_sensor) const {
  if (effects_.cross_talk == 0.0) return on_sensor;
  const auto to_each = static_cast<float>(0.25 * effects_.cross_talk);
  const cv::Mat kernel =
      (cv::Mat_<float>(3, 3) << 0, to_each, 0, to_each, 1.0F - 4.0F * to_each, to_each, 0, to_each, 0);
  cv::Mat mixed;
  cv::filter2D(on_sensor, mixed, CV_32F, kernel, {-1, -1}, 0.0, cv::BORDER_REFLECT_101);
  return mixed;
}

double ImageSensor::black_of(std::uint64_t noise_key) const {
  const double drawn = uniform(mix(noise_key, PixelRandom::black, is_left_));
  return effects_.black_grey + effects_.black_drift_grey * (2.0 * drawn - 1.0);
}

double ImageSensor::hot_excess(int x, int y) const {
  if (!(effects_.hot_pixels > 0.0)) return 0.0;
  const double drawn =
      uniform(mix(static_cast<std::uint64_t>(PixelRandom::hot), is_left_, static_cast<std::size_t>(y), x)) /
      effects_.hot_pixels;
  return drawn < 1.0 ? 30.0 + 170.0 * drawn : 0.0;
}

cv::Mat ImageSensor::expose(const cv::Mat& on_sensor, std::uint64_t noise_key, double noise_factor) const {
  const Profile& p = profile();
  const Effects& e = effects_;
  const cv::Mat light = cross_talked(on_sensor);
  cv::Mat raw(light.rows, light.cols, coding_.bits > 8 ? CV_16U : CV_8U);
  const double full = (1 << coding_.bits) - 1.0;
  const double cx = 0.5 * (raw.cols - 1), cy = 0.5 * (raw.rows - 1);
  const double off_x = e.vignetting_off_px * raw.cols / p.width, off_y = -0.5 * off_x;
  const double gain = 1.0 + (is_left_ ? 0.5 : -0.5) * e.gain_difference;
  const auto own = [&](PixelRandom what, auto... at) { return mix(static_cast<std::uint64_t>(what), is_left_, at...); };
  std::vector<double> column(raw.cols, black_of(noise_key));
  for (int x = 0; x < raw.cols && e.column_grey > 0.0; ++x)
    column[x] += e.column_grey * normal(own(PixelRandom::column, x));
  parallel_for(static_cast<std::size_t>(raw.rows), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    const auto* in = light.ptr<float>(y);
    for (int x = 0; x < raw.cols; ++x) {
      const double dx = x - cx - off_x, dy = y - cy - off_y, off = (dx * dx + dy * dy) / (cx * cx + cy * cy);
      double grey = 255.0 * in[x] * (1.0 - e.vignetting * off);
      if (gain != 1.0) grey *= gain;
      if (e.prnu > 0.0) grey *= 1.0 + e.prnu * normal(own(PixelRandom::gain, row, x));
      grey += hot_excess(x, y);
      if (noise_key != 0) {
        const double variance = p.read_noise * p.read_noise + p.shot_noise_variance * std::max(0.0, grey);
        grey += noise_factor * std::sqrt(variance) * normal(mix(noise_key, row, x));
      }
      double value = std::clamp(grey + column[x], 0.0, 255.0);
      if (coding_.gamma != 1.0) value = 255.0 * std::pow(value / 255.0, coding_.gamma);
      if (coding_.bits > 8) {
        raw.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(std::lround(value * (full / 255.0)));
      } else {
        raw.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(std::lround(value));
      }
    }
  });
  return raw;
}

}  // namespace scanrig::sim
