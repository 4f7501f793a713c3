#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "config/rig_config.h"
#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "core/statistics.h"
#include "core/timestamp.h"
#include "daemon/ctl/camera_bench.h"
#include "daemon/ctl/doctor/examine_rig.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/characterise/characterisation_file.h"
#include "pipeline/characterise/flat_folder.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> kFlatSides{"left", "right"};
constexpr int kDarkPairs = 8;
// Of the longest exposure that is not saturated; the last one saturates.
constexpr double kExposureShares[] = {1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 3.0 / 4, 1.0, 6.0};
constexpr int kMinExposureUs = 10, kMaxExposureUs = 1'000'000;

Result<void> write_flat(const fs::path& file, const cv::Mat& image) {
  const auto bytes = encode_png(image);
  if (!bytes) return pass_on(bytes);
  return write_file_atomically(file, *bytes);
}

/// Grey value that 1 % of the brighter image's pixels exceed, as a share of full scale.
double brightest(const StereoFrame& frame) {
  double most = 0.0;
  for (const cv::Mat* image : {&frame.left, &frame.right}) {
    std::vector<double> greys;
    constexpr int kStep = 5;  // odd: all colours of a mosaic
    for (int y = 0; y < image->rows; y += kStep) {
      for (int x = 0; x < image->cols; x += kStep) greys.push_back(image->ptr<std::uint8_t>(y)[x] / 255.0);
    }
    most = std::max(most, quantile(std::move(greys), 0.99));
  }
  return most;
}

/// Takes flats at the rig into a folder.
class FlatSession {
 public:
  FlatSession(const CharacteriseVerb& verb, const doctor::Operator& person) : verb_(verb), person_(person) {}

  Result<void> run() {
    if (auto ready = prompt("Hold a sheet of paper close to both lenses, evenly lit and not to be moved. Press Enter.");
        !ready) {
      return ready;
    }
    const auto longest = longest_exposure();
    if (!longest) return pass_on(longest);
    if (auto made = create_directories_synced(verb_.images); !made) return made;
    std::vector<int> taken;
    for (const double share : kExposureShares) {
      const int exposure = std::clamp(static_cast<int>(std::lround(share * *longest)), kMinExposureUs, kMaxExposureUs);
      if (std::ranges::find(taken, exposure) != taken.end()) continue;
      taken.push_back(exposure);
      if (auto shot = shoot(exposure, exposure, 1); !shot) return shot;
    }
    if (auto ready = prompt("Cover both lenses. Press Enter."); !ready) return ready;
    if (auto shot = shoot(*longest, 0, kDarkPairs); !shot) return shot;
    return write_file_atomically(verb_.images / kFlatList, flat_list(serials_, gain_settings_));
  }

 private:
  [[nodiscard]] Result<void> prompt(const std::string& what) const {
    if (person_.prompt(what)) return {};
    return fail(ErrorCode::invalid_input,
                "camera characterise: no person responds; run it at a terminal, or give --interactive or --from");
  }

  Result<std::unique_ptr<CameraBench>> bench_at(int exposure_us) {
    auto bench = CameraBench::open(verb_.config, {exposure_us, verb_.gain});
    if (!bench) return bench;
    const auto& camera = (*bench)->rig().stereo_camera;
    std::tie(serials_[0], serials_[1]) = camera.serials();
    const bool is_aravis = camera.driver == config::StereoCameraConfig::Driver::aravis;
    const std::string gain = is_aravis ? (camera.aravis.gain ? fmt::format("{}", *camera.aravis.gain) : "")
                                       : (camera.v4l2.gain ? fmt::format("{}", *camera.v4l2.gain) : "");
    gain_settings_ = {gain, gain};
    return bench;
  }

  /// At which the paper fills three quarters of full scale where it is brightest.
  Result<int> longest_exposure() {
    constexpr double kFill = 0.75, kEnough = 0.08, kFull = 0.95;
    constexpr int kSteps = 8;
    const auto rig = config::read_rig_config(verb_.config, {}, config::Cameras::or_simulated);
    if (!rig) return pass_on(rig);
    int exposure = static_cast<int>(rig->stereo_camera.exposure.count());
    for (int i = 0; i < kSteps; ++i) {
      const auto bench = bench_at(exposure);
      if (!bench) return pass_on(bench);
      const auto frame = (*bench)->expose(verb_.light);
      if (!frame) return pass_on(frame);
      const double fill = brightest(*frame);
      if (std::abs(fill - kFill) < kEnough) return exposure;
      const double factor = fill > kFull ? 0.25 : std::min(8.0, kFill / std::max(fill, 0.01));
      const int next = std::clamp(static_cast<int>(std::lround(exposure * factor)), kMinExposureUs, kMaxExposureUs);
      if (next == exposure) break;
      exposure = next;
    }
    return fail(ErrorCode::out_of_range,
                "camera characterise: no exposure from {} to {} us makes the paper three quarters bright; change the "
                "light",
                kMinExposureUs, kMaxExposureUs);
  }

  /// `named_us`: in the files' names; 0: dark.
  Result<void> shoot(int exposure_us, double named_us, int pairs) {
    const auto bench = bench_at(exposure_us);
    if (!bench) return pass_on(bench);
    for (int number = 1; number <= 2 * pairs; ++number) {
      const auto frame = (*bench)->expose(verb_.light);
      if (!frame) return pass_on(frame);
      for (std::size_t side = 0; side < kFlatSides.size(); ++side) {
        const auto file = verb_.images / flat_file_name(side, named_us, number);
        if (auto written = write_flat(file, side == 0 ? frame->left : frame->right); !written) return written;
      }
    }
    return {};
  }

  const CharacteriseVerb& verb_;
  const doctor::Operator& person_;
  std::array<std::string, 2> serials_, gain_settings_;
};

struct Places {
  fs::path out;
  std::array<std::string, 2> serials;  ///< of the configuration; empty: not known
};

/// With `--from` a configuration is not needed.
Result<Places> places_of(const CharacteriseVerb& verb) {
  Places places{verb.out, {}};
  const auto rig = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
  if (rig) {
    std::tie(places.serials[0], places.serials[1]) = rig->stereo_camera.serials();
    if (places.out.empty()) places.out = rig->calibration_file.parent_path() / kCharacterisationFile;
  } else if (verb.from.empty() || rig.error().code != ErrorCode::not_found) {
    return pass_on(rig);
  }
  if (places.out.empty()) places.out = kCharacterisationFile;
  return places;
}

Result<std::vector<SensorCharacterisation>> cameras_of(const fs::path& folder, const CharacteriseVerb& verb,
                                                       const Places& places) {
  const auto flats = read_flat_folder(folder);
  if (!flats) return pass_on(flats);
  std::vector<SensorCharacterisation> cameras;
  for (std::size_t side = 0; side < kFlatSides.size(); ++side) {
    if (flats->pairs.at(side).empty()) continue;
    const std::string &of_flats = flats->serials.at(side), &of_rig = places.serials.at(side);
    if (!of_flats.empty() && !of_rig.empty() && of_flats != of_rig) {
      return fail(ErrorCode::invalid_input,
                  "{}: its {} images are of camera {}, the configuration names {}; take flats of this rig's cameras",
                  folder.string(), kFlatSides.at(side), of_flats, of_rig);
    }
    auto found = catch_exceptions(
        "the characterisation", [&] { return characterise(flats->pairs.at(side), {.bits = 8, .gamma = verb.gamma}); });
    if (!found) return pass_on(found, kFlatSides.at(side));
    found->serial = of_flats.empty() ? of_rig : of_flats;
    found->gain_setting = flats->gain_settings.at(side);
    cameras.push_back(std::move(*found));
  }
  return cameras;
}

void print_camera(const SensorCharacterisation& camera) {
  fmt::print("camera {}, {} x {}, {} bit\n", camera.serial.empty() ? "-" : camera.serial, camera.width, camera.height,
             camera.bits);
  const auto line = [](const char* what, const std::string& is) { fmt::print("  {:<16} {}\n", what, is); };
  line("gain K", fmt::format("{:.4f} +- {:.4f} grey per electron", camera.gain, camera.gain_sigma));
  line("black level", fmt::format("{:.2f} grey", camera.black));
  line("read noise", fmt::format("{:.2f} grey, {:.1f} electrons", camera.read_noise, camera.read_noise / camera.gain));
  line("PRNU", std::isnan(camera.prnu) ? "-" : fmt::format("{:.2f} %", 100.0 * camera.prnu));
  line("DSNU", fmt::format("{:.2f} grey; columns {:.2f}, rows {:.2f}", camera.dsnu, camera.column, camera.row));
  line("saturation", std::isnan(camera.saturation)
                         ? "not reached"
                         : fmt::format("{:.0f} grey, {:.0f} electrons", camera.saturation, camera.full_well()));
  line("linearity", fmt::format("{:.1f} % at most, the light changed by {:.1f} %", 100.0 * camera.linearity_error,
                                100.0 * camera.light_change));
  line("hot pixels", fmt::format("{}", camera.hot_pixels.size()));
  for (const std::string& remark : camera.remarks) fmt::print("  {}\n", remark);
}

/// What was there is kept under a name with a part of its hash.
Result<void> write_kept(const fs::path& file, const std::string& text) {
  std::error_code ignored;
  if (fs::exists(file, ignored)) {
    const auto old = read_file(file);
    if (!old) return pass_on(old);
    fs::path kept = file;
    kept.replace_extension(sha256(*old).substr(0, 8) + file.extension().string());
    if (auto written = write_file_atomically(kept, *old); !written) return written;
  }
  return write_file_atomically(file, text);
}

}  // namespace

ExitCode characterise_cameras(const CharacteriseVerb& verb) {
  const auto places = places_of(verb);
  if (!places) return report_error(places.error());
  fs::path folder = verb.from;
  if (folder.empty()) {
    folder = verb.images;
    std::error_code ignored;
    if (fs::exists(folder, ignored)) {
      return report_error({ErrorCode::exists, folder.string() + ": already there; name another folder with --images"});
    }
    const doctor::Operator person(verb.answers, verb.json);
    if (auto taken = FlatSession(verb, person).run(); !taken) return report_error(taken.error());
  }
  auto cameras = cameras_of(folder, verb, *places);
  if (!cameras) return report_error(cameras.error());
  const CharacterisationFile file{iso_time(std::chrono::system_clock::now()), std::move(*cameras)};
  const std::string text = encode_characterisation(file);
  if (auto written = write_kept(places->out, text); !written) return report_error(written.error());
  if (verb.json) {
    fmt::print("{}", text);
    return ExitCode::ok;
  }
  for (const SensorCharacterisation& camera : file.cameras) print_camera(camera);
  fmt::print("{}\n", places->out.string());
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
