#include "sim/apps/shoot_flats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/image_codec.h"
#include "sim/scene/camera_model.h"
#include "sim/scene/optics.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/rig_effects.h"

namespace scanrig::sim {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

enum class FlatRandom : std::uint8_t { light = 110 };

constexpr std::array<const char*, 2> kSides{"left", "right"};
constexpr double kFill = 0.7;  // of full scale, where the paper is brightest
constexpr const char* kTruth = "flats_truth.json";

/// The light of a sheet of paper behind the colour filters (RGGB), 1.0 = full scale at the reference exposure: brighter
/// to one side and in the middle, and warmer than the sensor's white.
cv::Mat1f paper(int width, int height, bool is_left) {
  constexpr std::array<float, 3> kColour{0.85F, 1.0F, 0.7F};
  cv::Mat1f light(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = 2.0 * x / width - 1.0, v = 2.0 * y / height - 1.0;
      const double even = 1.0 - 0.12 * (u * u + v * v) - 0.08 * (1.0 + (is_left ? u : -u));
      light(y, x) = static_cast<float>(kFill * even) *
                    kColour.at(static_cast<std::size_t>(x & 1) + static_cast<std::size_t>(y & 1));
    }
  }
  return light;
}

struct Taken {
  std::array<double, 2> black{};  ///< mean of the dark images
  int dark_images = 0;
};

class Shooting {
 public:
  Shooting(const ShootFlatsOptions& options, const fs::path& folder)
      : options_(options),
        folder_(folder),
        cameras_(both_cameras(options.profile, options.image_scale)),
        width_(static_cast<int>(std::lround(profile().width * options.image_scale))),
        height_(static_cast<int>(std::lround(profile().height * options.image_scale))) {}

  /// `share`: of the reference exposure's light; 0: dark.
  Result<void> pair(const std::string& light, double share, int first_number) {
    for (int number = first_number; number < first_number + 2; ++number, ++exposure_) {
      const double flicker =
          1.0 + options_.profile.effects.flicker * normal(mix(options_.seed, exposure_, FlatRandom::light));
      for (std::size_t side = 0; side < kSides.size(); ++side) {
        cv::Mat on_sensor;
        paper(width_, height_, side == 0).convertTo(on_sensor, CV_32F, share * flicker);
        const std::uint64_t key = mix(options_.seed, exposure_, side) | 1;
        const cv::Mat image = cameras_.at(side).sensor.expose(on_sensor, key);
        if (share == 0.0) taken_.black.at(side) += cameras_.at(side).sensor.black_of(key);
        const auto bytes = encode_png(image);
        if (!bytes) return pass_on(bytes, "shoot-flats");
        const auto file = folder_ / fmt::format("{}_{}_{:02}.png", kSides.at(side), light, number);
        if (auto written = write_file_atomically(file, *bytes); !written) return written;
      }
      if (share == 0.0) ++taken_.dark_images;
    }
    return {};
  }

  /// What the images were made with, in grey levels of 255.
  [[nodiscard]] ordered_json truth() const {
    const Effects& effects = options_.profile.effects;
    ordered_json json{
        {"format", "scanrig-flats-truth"},    {"version", 1},         {"gain", profile().shot_noise_variance},
        {"read_noise", profile().read_noise}, {"prnu", effects.prnu}, {"column", effects.column_grey},
        {"black", effects.black_grey}};
    for (std::size_t side = 0; side < kSides.size(); ++side) {
      auto hot = ordered_json::array();
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          const double excess = cameras_.at(side).sensor.hot_excess(x, y);
          if (excess > 0.0) hot.push_back({{"x", x}, {"y", y}, {"excess", excess}});
        }
      }
      json[kSides.at(side)] = {{"black_of_dark_images", taken_.black.at(side) / taken_.dark_images},
                               {"hot_pixels", hot}};
    }
    return json;
  }

 private:
  const ShootFlatsOptions& options_;
  const fs::path& folder_;
  std::array<CameraModel, 2> cameras_;
  int width_, height_;
  std::uint64_t exposure_ = 0;
  Taken taken_;
};

ordered_json list_of(const RigGeometry& rig) {
  return {{"format", "scanrig-flats"},
          {"version", 1},
          {"left", {{"serial", rig.left.serial}, {"gain_setting", "0"}}},
          {"right", {{"serial", rig.right.serial}, {"gain_setting", "0"}}}};
}

}  // namespace

Result<void> shoot_flats(const ShootFlatsOptions& options, const fs::path& folder) {
  const auto& times = options.exposures_us;
  const bool are_times = times.size() >= 2 && std::ranges::all_of(times, [](double t) { return t >= 1.0; });
  if (!(options.image_scale >= kSmallestImageScale && options.image_scale <= kLargestImageScale) ||
      options.dark_pairs < 1 || !are_times) {
    return fail(ErrorCode::out_of_range,
                "shoot-flats: image scale {}, {} dark pairs, {} exposures: choose {} to {}, at least one pair and "
                "two exposures of 1 us and more",
                options.image_scale, options.dark_pairs, times.size(), kSmallestImageScale, kLargestImageScale);
  }
  std::error_code ignored;
  if (fs::exists(folder / kTruth, ignored)) {
    return fail(ErrorCode::exists, "shoot-flats: {} holds flats already; name another folder", folder.string());
  }
  if (const auto made = create_directories_synced(folder); !made) return made;
  Shooting shooting(options, folder);
  for (int k = 0; k < options.dark_pairs; ++k) {
    if (auto taken = shooting.pair("dark", 0.0, 2 * k + 1); !taken) return taken;
  }
  const double reference = times[times.size() - 2];
  for (const double time : times) {
    if (auto taken = shooting.pair(fmt::format("{:.0f}us", time), time / reference, 1); !taken) return taken;
  }
  const DrawnRig rig = make_rig(std::nullopt, options.profile.effects, options.image_scale);
  const auto listed = write_file_atomically(folder / "flats.json", list_of(rig.geometry).dump(2) + "\n");
  if (!listed) return listed;
  return write_file_atomically(folder / kTruth, shooting.truth().dump(1) + "\n");
}

}  // namespace scanrig::sim
