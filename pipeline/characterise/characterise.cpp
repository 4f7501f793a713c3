#include "pipeline/characterise/characterise.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "core/statistics.h"
#include "pipeline/characterise/dark_pattern.h"
#include "pipeline/characterise/flat_planes.h"

namespace scanrig {
namespace {

using flats::Linear;
using flats::Tile;

constexpr std::size_t kMinExposures = 3;
constexpr double kMinExposureRatio = 4.0;   // of the longest to the shortest
constexpr double kMaxFullShare = 0.01;      // of the pixels at full scale: else overexposed
constexpr double kSaturatedShare = 0.9;     // on purpose, for the saturation
constexpr double kMinSignalSigma = 5.0;     // of the noise in the dark: else underexposed
constexpr double kMaxLightChange = 0.2;     // within a pair
constexpr double kMaxTransferShare = 0.7;   // of full scale [EMVA 1288, 6.6]: above, saturation begins
constexpr double kMinLinearShare = 0.05;    // of full scale: below, drift of the black level counts
constexpr double kMaxExponentError = 0.05;  // from 1
constexpr double kMaxClippedShare = 0.005;  // of dark pixels at 0 [EMVA 1288, 6.5]
constexpr double kMaxGainError = 0.1;       // sigma of K by K

/// An exposure with light.
struct Exposure {
  const FlatPair* pair = nullptr;
  std::vector<Tile> tiles;
  double grey = 0.0, variance = 0.0;
  double change = 0.0;  ///< of the light from the first to the second image, as a share
  bool is_saturated = false;
};

std::string size_of(const cv::Mat& image) { return fmt::format("{} x {}", image.cols, image.rows); }

Result<void> check_images(const std::vector<FlatPair>& pairs) {
  const cv::Mat& model = pairs.front().first;
  for (const FlatPair& pair : pairs) {
    for (const cv::Mat* image : {&pair.first, &pair.second}) {
      if (image->empty()) {
        return fail(ErrorCode::invalid_input, "{}: one image of the pair only; take both", pair.name);
      }
      if (image->channels() != 1 || (image->depth() != CV_8U && image->depth() != CV_16U)) {
        return fail(ErrorCode::invalid_input, "{}: is not a raw image: give one channel, mono or Bayer", pair.name);
      }
      if (image->size() != model.size() || image->type() != model.type()) {
        return fail(ErrorCode::invalid_input, "{}: is of {} pixels, {} of {}; take all with one setting", pair.name,
                    size_of(*image), pairs.front().name, size_of(model));
      }
    }
  }
  constexpr int kMinPx = 4 * flats::kTilePx;
  if (std::min(model.rows, model.cols) < kMinPx) {
    return fail(ErrorCode::invalid_input, "{}: is of {} pixels; {} each way are needed", pairs.front().name,
                size_of(model), kMinPx);
  }
  return {};
}

double full_share(const FlatPair& pair, double full) {
  double count = 0.0;
  for (const cv::Mat* image : {&pair.first, &pair.second}) {
    cv::Mat1b is_full;
    cv::compare(*image, full, is_full, cv::CMP_GE);
    count += cv::countNonZero(is_full);
  }
  return count / static_cast<double>(2 * pair.first.total());
}

Exposure exposure_of(const FlatPair& pair, const Linear& linear, const CharacteriseOptions& options,
                     const flats::DarkPattern& dark) {
  Exposure exposure{.pair = &pair, .tiles = flats::tiles_of(pair, linear, options.window_px, dark.defects)};
  double pixels = 0.0;
  for (const Tile& tile : exposure.tiles) {
    exposure.grey += tile.grey * tile.pixels;
    exposure.variance += tile.variance * tile.pixels;
    pixels += tile.pixels;
  }
  exposure.grey /= pixels;
  exposure.variance /= pixels;
  const double first = cv::mean(linear(pair.first))[0] - dark.black,
               second = cv::mean(linear(pair.second))[0] - dark.black;
  exposure.change = second / first - 1.0;
  exposure.is_saturated = full_share(pair, std::pow(2.0, options.bits) - 1.0) > kSaturatedShare;
  return exposure;
}

Result<void> check_exposure(const Exposure& exposure, const flats::DarkPattern& dark, double full) {
  const FlatPair& pair = *exposure.pair;
  if (exposure.is_saturated) return {};
  if (const double share = full_share(pair, full); share > kMaxFullShare) {
    return fail(ErrorCode::invalid_input, "{}: overexposed, {:.1f} % of it is at full scale; expose shorter", pair.name,
                100.0 * share);
  }
  const double noise = std::sqrt(dark.variance);
  if (exposure.grey - dark.black < kMinSignalSigma * noise) {
    return fail(ErrorCode::invalid_input,
                "{}: underexposed, grey {:.1f} where the dark is {:.1f}; give more light or expose longer", pair.name,
                exposure.grey, dark.black);
  }
  if (std::abs(exposure.change) > kMaxLightChange) {
    return fail(ErrorCode::invalid_input, "{}: the light changed by {:.0f} % within the pair; take it again", pair.name,
                100.0 * std::abs(exposure.change));
  }
  return {};
}

/// Line of the variance over the grey value, without rounding.
struct Transfer {
  double gain = 0.0, gain_sigma = 0.0, at_black = 0.0;
};

Transfer transfer_of(const std::vector<const std::vector<Tile>*>& sets, const Linear& linear, double black) {
  Transfer line;
  // Begins with equal weights, then by the variance that the line gives.
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const auto* tiles : sets) {
      for (const Tile& tile : *tiles) {
        if (tile.is_clipped || tile.pixels < 2 || tile.grey > kMaxTransferShare * linear.full()) continue;
        const double rounding = linear.rounding(tile.grey), signal = tile.grey - black;
        const double expected = round == 0 ? 1.0 : std::max(0.1, line.at_black + rounding + line.gain * signal);
        const double weight = (tile.pixels - 1) / (2.0 * expected * expected);
        const Eigen::Vector2d row(1.0, signal);
        normal += weight * row * row.transpose();
        sum += weight * row * (tile.variance - rounding);
      }
    }
    const Eigen::Vector2d solution = normal.ldlt().solve(sum);
    line = {solution[1], std::sqrt(normal.inverse()(1, 1)), solution[0]};
  }
  return line;
}

/// Gains of the pixels: what is fixed in the light and not in the dark, as a share of the light.
double prnu_of(const std::vector<Exposure>& exposures, const flats::DarkPattern& dark, double full) {
  double fixed = 0.0, light = 0.0;
  for (const Exposure& exposure : exposures) {
    // The brighter half shows it best, as EMVA 1288 takes 50 % of saturation.
    if (exposure.is_saturated || exposure.grey < 0.25 * full) continue;
    for (const Tile& tile : exposure.tiles) {
      if (tile.is_clipped) continue;
      const double signal = tile.grey - dark.black;
      fixed += tile.pixels * (tile.fixed - dark.dsnu * dark.dsnu);
      light += tile.pixels * signal * signal;
    }
  }
  return light > 0.0 ? std::sqrt(std::max(0.0, fixed / light)) : std::numeric_limits<double>::quiet_NaN();
}

struct Linearity {
  double exponent = 1.0;  ///< with which values are still coded
  double error = 0.0;     ///< largest, as a share
  double light_change = 0.0;
};

/// Slope of the logarithms of `signals` over those of `times`.
double log_slope(const std::vector<double>& times, const std::vector<double>& signals) {
  const auto count = static_cast<double>(times.size());
  double mean_time = 0.0, mean_signal = 0.0, products = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    mean_time += std::log(times[i]) / count;
    mean_signal += std::log(signals[i]) / count;
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double time = std::log(times[i]) - mean_time;
    products += time * (std::log(signals[i]) - mean_signal);
    squares += time * time;
  }
  return products / squares;
}

/// The exponent without which grey values, less that of the dark, are proportional to the exposure. Grey over the dark
/// has a larger one of its own: black level is added before values are coded.
double exponent_of(const std::vector<double>& times, const std::vector<double>& greys, double black, double full) {
  double low = 0.1, high = 10.0;
  constexpr int kHalvings = 40;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = std::sqrt(low * high);
    const auto decoded = [&](double grey) { return std::pow(grey / full, 1.0 / middle); };
    std::vector<double> signals;
    for (const double grey : greys) signals.push_back(decoded(grey) - decoded(black));
    // Never steeper with a larger exponent.
    (log_slope(times, signals) > 1.0 ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

Linearity linearity_of(const std::vector<Exposure>& exposures, double black, double full) {
  std::vector<double> changes, times, greys, ratios;
  for (const Exposure& exposure : exposures) {
    if (exposure.is_saturated) continue;
    if (exposure.grey - black < kMinLinearShare * full) continue;
    changes.push_back(exposure.change / std::sqrt(2.0));
    times.push_back(exposure.pair->exposure_us);
    greys.push_back(exposure.grey);
    ratios.push_back((exposure.grey - black) / exposure.pair->exposure_us);
  }
  Linearity found;
  found.light_change = root_mean_square(changes);
  if (ratios.size() < 2) return found;
  const double mean = std::accumulate(ratios.begin(), ratios.end(), 0.0) / static_cast<double>(ratios.size());
  for (const double ratio : ratios) found.error = std::max(found.error, std::abs(ratio / mean - 1.0));
  if (std::ranges::min(times) < std::ranges::max(times)) found.exponent = exponent_of(times, greys, black, full);
  return found;
}

/// The highest value that most of the longest exposure has; NaN: no exposure was that long.
double saturation_of(const std::vector<Exposure>& exposures) {
  double highest = std::numeric_limits<double>::quiet_NaN();
  for (const Exposure& exposure : exposures) {
    if (exposure.is_saturated) highest = exposure.grey;
  }
  return highest;
}

Result<void> check_exposures(const std::vector<Exposure>& exposures) {
  double shortest = 1e300, longest = 0.0;
  std::vector<double> times;
  for (const Exposure& exposure : exposures) {
    if (exposure.is_saturated) continue;
    times.push_back(exposure.pair->exposure_us);
    shortest = std::min(shortest, times.back());
    longest = std::max(longest, times.back());
  }
  std::ranges::sort(times);
  const auto distinct = static_cast<std::size_t>(std::unique(times.begin(), times.end()) - times.begin());
  if (distinct >= kMinExposures && longest >= kMinExposureRatio * shortest) return {};
  return fail(ErrorCode::invalid_input,
              "flat images: {} exposures, the longest {:.1f} times the shortest; {} are needed, and {:.0f} times",
              distinct, distinct > 0 ? longest / shortest : 0.0, kMinExposures, kMinExposureRatio);
}

void add_remarks(SensorCharacterisation& found, const flats::DarkPattern& dark, const Linearity& linearity) {
  if (dark.clipped_share > kMaxClippedShare) {
    found.remarks.push_back(fmt::format("{:.1f} % of the dark pixels are at 0: raise the camera's black level",
                                        100.0 * dark.clipped_share));
  }
  if (std::isnan(found.prnu)) found.remarks.emplace_back("No flat reaches a quarter of full scale: expose longer");
  constexpr double kUnsteady = 0.05;
  if (linearity.light_change > kUnsteady) {
    found.remarks.push_back(fmt::format("The light changes by {:.0f} % from image to image: use a steady one",
                                        100.0 * linearity.light_change));
  }
}

Result<std::vector<Exposure>> exposures_of(const std::vector<const FlatPair*>& lit, const Linear& linear,
                                           const CharacteriseOptions& options, const flats::DarkPattern& dark) {
  std::vector<Exposure> exposures;
  for (const FlatPair* pair : lit) {
    exposures.push_back(exposure_of(*pair, linear, options, dark));
    if (auto good = check_exposure(exposures.back(), dark, linear.full()); !good) return pass_on(good);
  }
  std::ranges::stable_sort(
      exposures, [](const Exposure& a, const Exposure& b) { return a.pair->exposure_us < b.pair->exposure_us; });
  if (auto enough = check_exposures(exposures); !enough) return pass_on(enough);
  return exposures;
}

}  // namespace

NoiseModel SensorCharacterisation::noise_model() const {
  return {.gain = gain,
          .black = black,
          .read_noise = read_noise,
          .prnu = std::isnan(prnu) ? NoiseModel{}.prnu : prnu,
          .column = column,
          .is_measured = true};
}

Result<SensorCharacterisation> characterise(const std::vector<FlatPair>& pairs, const CharacteriseOptions& options) {
  std::vector<const FlatPair*> darks, lit;
  for (const FlatPair& pair : pairs) (pair.exposure_us > 0.0 ? lit : darks).push_back(&pair);
  if (darks.empty() || lit.empty()) {
    return fail(ErrorCode::invalid_input, "flat images: no {} pair; take one {}", darks.empty() ? "dark" : "lit",
                darks.empty() ? "with the lens covered" : "of a sheet of paper");
  }
  if (auto good = check_images(pairs); !good) return pass_on(good);
  const Linear linear(options);
  const flats::DarkPattern dark = flats::dark_pattern(darks, linear, options.window_px);
  const auto exposures = exposures_of(lit, linear, options, dark);
  if (!exposures) return pass_on(exposures);

  const Linearity linearity = linearity_of(*exposures, dark.black, linear.full());
  if (std::abs(linearity.exponent - 1.0) > std::max(kMaxExponentError, 3.0 * linearity.light_change)) {
    return fail(ErrorCode::invalid_input,
                "flat images: values are coded with a gamma of {:.2f}, not {:.2f}; switch gamma off in the camera, or "
                "name it with --gamma",
                options.gamma * linearity.exponent, options.gamma);
  }
  std::vector<std::vector<Tile>> dark_tiles;
  for (const FlatPair* pair : darks) {
    dark_tiles.push_back(flats::tiles_of(*pair, linear, options.window_px, dark.defects));
  }
  std::vector<const std::vector<Tile>*> sets;
  for (const auto& tiles : dark_tiles) sets.push_back(&tiles);
  for (const Exposure& exposure : *exposures) sets.push_back(&exposure.tiles);
  const Transfer transfer = transfer_of(sets, linear, dark.black);
  if (!(transfer.gain > 0.0) || transfer.gain_sigma > kMaxGainError * transfer.gain) {
    return fail(ErrorCode::invalid_input,
                "flat images: noise does not grow with light; switch the camera's noise reduction, sharpening and "
                "gamma off");
  }
  SensorCharacterisation found;
  found.width = pairs.front().first.cols;
  found.height = pairs.front().first.rows;
  found.bits = options.bits;
  found.gamma = options.gamma;
  found.gain = transfer.gain;
  found.gain_sigma = transfer.gain_sigma;
  found.black = dark.black;
  found.read_noise = std::sqrt(std::max(0.0, transfer.at_black));
  found.prnu = prnu_of(*exposures, dark, linear.full());
  found.dsnu = dark.dsnu;
  found.column = dark.column;
  found.row = dark.row;
  found.saturation = saturation_of(*exposures);
  found.linearity_error = linearity.error;
  found.light_change = linearity.light_change;
  found.hot_pixels = dark.hot_pixels;
  found.curve.push_back({0.0, dark.black, dark.variance});
  for (const Exposure& exposure : *exposures) {
    found.curve.push_back({exposure.pair->exposure_us, exposure.grey, exposure.variance});
  }
  add_remarks(found, dark, linearity);
  return found;
}

}  // namespace scanrig
