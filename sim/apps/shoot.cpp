#include "sim/apps/shoot.h"

#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/hash.h"
#include "core/image_codec.h"
#include "core/units.h"
#include "daemon/rig/exposure_choice.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/rest_error.h"
#include "sim/scene/truth_writer.h"

namespace scanrig::sim {
namespace {

using nlohmann::ordered_json;
namespace fs = std::filesystem;

Result<std::string> save_png(const cv::Mat& image, const fs::path& file) {
  const auto bytes = encode_png(image);
  if (!bytes) return pass_on(bytes, "shoot");
  if (const auto written = write_file_atomically(file, *bytes); !written) return pass_on(written);
  return sha256(*bytes);
}

struct ViewAngle {
  int index;
  double commanded_deg;
  double rest_deg;  ///< where the drive's axis rests, as its encoder measures
  double true_deg;  ///< of the table
};

/// Left and right image as files of `path`, entered in `files`.
Result<void> save_pair(const StereoImages& images, const std::string& what, const fs::path& folder,
                       const std::string& path, ordered_json& files) {
  for (const bool left : {true, false}) {
    const std::string name = fmt::format("{}_{}", left ? "left" : "right", what);
    const std::string file = fmt::format("{}/{}.png", path, name);
    const auto hash = save_png(left ? images.left : images.right, folder / file);
    if (!hash) return pass_on(hash);
    files[name] = {{"path", file}, {"sha256", *hash}};
  }
  return {};
}

Result<ordered_json> shoot_view(Scene& scene, int pose, const ViewAngle& angle, const fs::path& folder,
                                std::uint64_t exposure, std::span<const double> offered) {
  constexpr double kSecondsPerView = 10.0;
  constexpr std::uint64_t kFirstAdded = std::uint64_t{1} << 31;  // the first ones keep their noise
  const std::string path = fmt::format("pose{}/view{:02}", pose + 1, angle.index);
  if (const auto made = create_directories_synced(folder / path); !made) return pass_on(made);
  ordered_json files = ordered_json::object();
  const std::uint64_t views_before = exposure / 2;
  const double minutes = kSecondsPerView / 60.0 * static_cast<double>(views_before);
  const auto shot = [&](bool pattern, std::uint64_t number, double duration = 1.0) {
    return scene.shoot(pose, to_radians(angle.true_deg), pattern, number, minutes, duration);
  };
  const StereoImages pattern = shot(true, exposure), plain = shot(false, exposure + 1);
  if (auto saved = save_pair(pattern, "pattern", folder, path, files); !saved) return pass_on(saved);
  if (auto saved = save_pair(plain, "plain", folder, path, files); !saved) return pass_on(saved);
  const auto factors = wanted_exposures({{pattern.left, plain.left}, {pattern.right, plain.right}}, offered);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto images = shot(true, kFirstAdded + 2 * exposure + i, factors[i]);
    const auto saved = save_pair(images, fmt::format("pattern_x{:g}", factors[i]), folder, path, files);
    if (!saved) return pass_on(saved);
  }
  const int seconds = static_cast<int>(kSecondsPerView) * static_cast<int>(views_before + 1);
  ordered_json view = {{"index", angle.index},
                       {"commanded_deg", angle.commanded_deg},
                       {"measured_deg", encoder_reading(angle.rest_deg)},
                       {"moving_ms", angle.index == 0 ? 0 : 1500},
                       {"settling_ms", static_cast<int>(1e3 * profile().settling_s)},
                       {"taken", fmt::format("2026-11-21T09:{:02}:{:02}Z", seconds / 60 % 60, seconds % 60)},
                       {"pixel_format", "BayerRG8"},
                       {"files", files}};
  if (!factors.empty()) view["pattern_factors"] = factors;
  return view;
}

Result<ordered_json> manifest(const fs::path& folder, const SceneOptions& options) {
  const auto calibration = read_file(folder / "calibration.json");
  if (!calibration) return pass_on(calibration);
  return ordered_json{{"format", "scanrig-scan"},
                      {"version", 6},
                      {"id", fmt::format("20261121-090000-{}", options.seed)},
                      {"created", "2026-11-21T09:00:00Z"},
                      {"state", "scanned"},
                      {"source", "stereo"},
                      {"profile", options.profile.sha256()},
                      {"config_sha256", ordered_json::array()},
                      {"calibration", {{"file", "calibration.json"}, {"sha256", sha256(*calibration)}}},
                      {"poses", ordered_json::array()}};
}

}  // namespace

Result<void> shoot(const ShootOptions& options, const fs::path& folder) {
  if (options.views < 1 || options.views > 99) {
    return fail(ErrorCode::out_of_range, "shoot: {} views per pose; choose 1 to 99", options.views);
  }
  std::error_code ignored;
  if (fs::exists(folder / "scan.json", ignored)) {
    return fail(ErrorCode::exists, "shoot: {} holds a scan already; name another folder", folder.string());
  }
  SceneOptions scene_options = options.scene;
  scene_options.views = options.views;
  auto scene = Scene::create(scene_options);
  if (!scene) return pass_on(scene);
  std::string solved;
  if (!options.calibration.empty()) {
    auto read = read_file(options.calibration);
    if (!read) return pass_on(read, "shoot: calibration");
    solved = std::move(*read);
  }
  if (const auto made = create_directories_synced(folder); !made) return made;
  const fs::path calibration = folder / "calibration.json";
  const auto written_calibration =
      solved.empty() ? write_calibration(**scene, calibration) : write_file_atomically(calibration, solved);
  if (!written_calibration) return written_calibration;
  auto json = manifest(folder, options.scene);
  if (!json) return pass_on(json);
  std::vector<PoseTruth> truth;
  std::uint64_t exposure = 0;
  for (int pose = 0; pose < options.scene.poses; ++pose) {
    ordered_json views = ordered_json::array();
    truth.push_back({pose, {}});
    for (int index = 0; index < options.views; ++index, exposure += 2) {
      const double commanded = 360.0 * index / options.views;
      const double rest_deg = resting_angle(commanded + 360.0 * pose, options.scene.seed) - 360.0 * pose;
      const double true_deg = (*scene)->drawn_rig().table.true_deg(rest_deg);
      const auto view =
          shoot_view(**scene, pose, {index, commanded, rest_deg, true_deg}, folder, exposure, options.pattern_factors);
      if (!view) return pass_on(view);
      views.push_back(*view);
      truth.back().angles_deg.push_back(true_deg);
    }
    (*json)["poses"].push_back({{"name", fmt::format("pose{}", pose + 1)},
                                {"complete", true},
                                {"views", views},
                                {"movement_checks", ordered_json::array()}});
  }
  if (const auto written = write_truth(**scene, truth, folder); !written) return written;
  return write_file_atomically(folder / "scan.json", json->dump(2) + "\n");
}

}  // namespace scanrig::sim
