#include "drivers/camera/aravis_setup.h"

#include <array>
#include <cmath>

namespace scanrig {
namespace {

/// Entries and flags that keep a sensor's values as they are read [GenICam SFNC 2.7, 4, 5 and 10].
constexpr std::array<std::pair<const char*, const char*>, 7> kNeutral{{{"TestPattern", "Off"},
                                                                       {"TestImageSelector", "Off"},
                                                                       {"ExposureMode", "Timed"},
                                                                       {"ExposureAuto", "Off"},
                                                                       {"GainAuto", "Off"},
                                                                       {"BlackLevelAuto", "Off"},
                                                                       {"BalanceWhiteAuto", "Off"}}};
constexpr std::array kSwitchedOff{"ReverseX",       "ReverseY",        "GammaEnable",      "LUTEnable",
                                  "HueEnable",      "SharpnessEnable", "SaturationEnable", "ColorTransformationEnable",
                                  "ChunkModeActive"};
constexpr std::array kWholePixels{"BinningHorizontal", "BinningVertical", "DecimationHorizontal", "DecimationVertical"};
constexpr double kFine = 0.01;  // of a gamma, a ratio

Result<void> set_neutral(ArvCamera* camera, const GenicamCall& attempt) {
  for (const auto& [feature, entry] : kNeutral) {
    if (auto set = set_entry_if_present(camera, feature, entry, attempt); !set) return set;
  }
  for (const char* feature : kSwitchedOff) {
    if (auto set = set_flag_if_present(camera, feature, false, attempt); !set) return set;
  }
  for (const char* feature : kWholePixels) {
    if (auto set = set_whole_if_present(camera, feature, 1, attempt); !set) return set;
  }
  if (has_feature(camera, "GammaEnable")) return {};
  return set_number_if_present(camera, "Gamma", 1.0, kFine, attempt);
}

/// Factors of the colours that leave the sensor's values as they are. A calibrated rig needs the same ones always.
Result<void> set_up_colours(ArvCamera* camera, const GenicamCall& attempt) {
  for (const std::string& colour : entries_of(camera, "BalanceRatioSelector")) {
    if (auto set = set_text(camera, "BalanceRatioSelector", colour, attempt); !set) return set;
    if (auto set = set_number_if_present(camera, "BalanceRatio", 1.0, kFine, attempt); !set) return set;
  }
  return {};
}

/// The offsets are 0 while the size changes: what a larger size leaves of them is not known.
Result<void> set_up_region(ArvCamera* camera, const std::optional<Region>& wanted, const GenicamCall& attempt) {
  for (const char* offset : {"OffsetX", "OffsetY"}) {
    if (auto set = set_whole_if_present(camera, offset, 0, attempt); !set) return set;
  }
  const auto largest = [&](const char* feature, int& value) {
    return attempt(fmt::format("read the limits of {}", feature), [&](GError** error) {
      gint64 low = 0, high = 0;
      arv_camera_get_integer_bounds(camera, feature, &low, &high, error);
      value = static_cast<int>(high);
    });
  };
  Region region;
  if (wanted) {
    region = *wanted;
  } else {
    if (auto read = largest("Width", region.width); !read) return read;
    if (auto read = largest("Height", region.height); !read) return read;
  }
  if (auto set = set_whole(camera, "Width", region.width, attempt); !set) return set;
  if (auto set = set_whole(camera, "Height", region.height, attempt); !set) return set;
  if (!wanted) return {};
  if (auto set = set_whole(camera, "OffsetX", region.x, attempt); !set) return set;
  return set_whole(camera, "OffsetY", region.y, attempt);
}

Result<void> set_up_gain(ArvCamera* camera, const AravisOptions& options, bool is_standard,
                         const GenicamCall& attempt) {
  constexpr double kCoarseGain = 0.2;  // cameras round to steps
  if (auto set = set_entry_if_present(camera, "GainSelector", "All", attempt); !set) return set;
  double low = 0.0, high = 0.0, got = 0.0;
  const bool is_left = is_standard || !arv_camera_is_gain_available(camera, nullptr);
  if (!options.gain && is_left) return {};
  auto set = attempt(options.gain ? fmt::format("set the gain to {}", *options.gain) : "set the lowest gain",
                     [&](GError** error) {
                       if (!options.gain) arv_camera_get_gain_bounds(camera, &low, &high, error);
                       if (!*error) arv_camera_set_gain(camera, options.gain.value_or(low), error);
                       if (!*error) got = arv_camera_get_gain(camera, error);
                     });
  if (!set) return set;
  if (std::abs(got - options.gain.value_or(low)) <= kCoarseGain) return {};
  return fail(ErrorCode::invalid_input, "{}: asked for a gain of {} it has {:.2f}; choose a gain that it offers",
              attempt.who(), options.gain.value_or(low), got);
}

Result<void> set_up_black_level(ArvCamera* camera, const AravisOptions& options, bool is_standard,
                                const GenicamCall& attempt) {
  constexpr double kCoarseLevel = 0.5;
  if (!options.black_level && is_standard) return {};
  if (options.black_level && !has_feature(camera, "BlackLevel")) {
    return fail(ErrorCode::unsupported, "{}: the camera has no BlackLevel; leave black_level out", attempt.who());
  }
  if (auto set = set_entry_if_present(camera, "BlackLevelSelector", "All", attempt); !set) return set;
  constexpr double kLowest = -1e9;  // the nearest that the camera offers
  return set_number_if_present(camera, "BlackLevel", options.black_level.value_or(kLowest), kCoarseLevel, attempt);
}

}  // namespace

Result<void> set_exposure(ArvCamera* camera, std::chrono::microseconds exposure, const GenicamCall& attempt) {
  const auto wanted = static_cast<double>(exposure.count());
  double got = 0.0;
  auto set = attempt(fmt::format("set the exposure to {} us", exposure.count()), [&](GError** error) {
    arv_camera_set_exposure_time(camera, wanted, error);
    if (!*error) got = arv_camera_get_exposure_time(camera, error);
  });
  if (!set) return set;
  constexpr double kCoarse = 0.05;  // cameras round to lines of the sensor
  if (std::abs(got - wanted) > kCoarse * wanted) {
    return fail(ErrorCode::invalid_input, "{}: asked for an exposure of {} us it takes {:.0f} us", attempt.who(),
                exposure.count(), got);
  }
  return {};
}

Result<void> set_up_image(ArvCamera* camera, const AravisOptions& options, bool is_standard,
                          const GenicamCall& attempt) {
  if (!has_entry(camera, "PixelFormat", options.pixel_format)) {
    return fail(ErrorCode::unsupported, "{}: the camera has no pixel format {}", attempt.who(), options.pixel_format);
  }
  if (auto set = set_neutral(camera, attempt); !set) return set;
  if (auto set = set_text(camera, "PixelFormat", options.pixel_format, attempt); !set) return set;
  if (auto set = set_up_region(camera, options.region, attempt); !set) return set;
  if (auto set = set_up_colours(camera, attempt); !set) return set;
  if (auto set = set_up_gain(camera, options, is_standard, attempt); !set) return set;
  if (auto set = set_up_black_level(camera, options, is_standard, attempt); !set) return set;
  return set_exposure(camera, options.exposure, attempt);
}

}  // namespace scanrig
