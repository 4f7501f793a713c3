// calibration_error CALIBRATION RIG_SEED [NAME=NUMBER,...]: one line of JSON, the error of a calibration of this drawn
// rig (0: the default rig, "workshop": that of profile 2) over the working volume, full resolution.
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "pipeline/storage/calibration_file.h"
#include "sim/scene/calibration_series.h"
#include "tests/calibration_error.h"

namespace scanrig {
namespace {

int report_error(const std::string& sentence, int code) {
  fmt::print(stderr, "calibration_error: {}\n", sentence);
  return code;
}

int print_difference(const Calibration& one, const char* file) {
  const auto other = read_calibration(file);
  if (!other) return report_error(other.error().message, 3);
  fmt::print("{{\"difference_um\": {:.6f}}}\n", difference_um(one, *other));
  return 0;
}

int print_error(const Calibration& calibration, const char* seed, const char* changes) {
  sim::RigVariation variation{.seed = static_cast<std::uint64_t>(std::atoll(seed))};
  if (const auto set = sim::set_by_name(variation, sim::kRigVariationNames, changes); *changes && !set) {
    return report_error(set.error().message, 3);
  }
  constexpr double kFull = 1.0;
  const bool is_workshop = std::string_view(seed) == "workshop";
  const auto rig = is_workshop           ? sim::make_rig({}, sim::choose_effects("workshop", "", "").value(), kFull)
                   : variation.seed == 0 ? sim::make_rig({}, {}, kFull)
                                         : sim::make_rig(variation, {}, kFull);
  const CalibrationError error = calibration_error(calibration, rig.geometry);
  fmt::print("{{\"rms_um\": {:.4f}, \"max_um\": {:.4f}, \"scale_ppm\": {:.2f}, \"predicted_um\": {:.4f}}}\n",
             error.rms_um, error.max_um, error.scale_ppm, calibration.quality ? calibration.quality->volume_um : 0.0);
  return 0;
}

}  // namespace
}  // namespace scanrig

int main(int argc, char** argv) {
  using namespace scanrig;
  if (argc < 3) return report_error("needs CALIBRATION, then RIG_SEED [NAME=NUMBER,...] or CALIBRATION", 2);
  const auto calibration = read_calibration(argv[1]);
  if (!calibration) return report_error(calibration.error().message, 3);
  if (std::filesystem::exists(argv[2])) return print_difference(*calibration, argv[2]);
  return print_error(*calibration, argv[2], argc > 3 ? argv[3] : "");
}
