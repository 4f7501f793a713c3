// calibration_error CALIBRATION RIG_SEED [NAME=NUMBER,...]: one line of JSON, the error of a calibration of this drawn
// rig (0: the default rig) over the working volume, full resolution.
#include <fmt/format.h>

#include <cstdlib>

#include "pipeline/storage/calibration_file.h"
#include "sim/scene/calibration_series.h"
#include "tests/calibration_error.h"

int main(int argc, char** argv) {
  using namespace scanrig;
  if (argc < 3) {
    fmt::print(stderr, "calibration_error CALIBRATION RIG_SEED [NAME=NUMBER,...]\n");
    return 2;
  }
  const auto calibration = read_calibration(argv[1]);
  if (!calibration) {
    fmt::print(stderr, "calibration_error: {}\n", calibration.error().message);
    return 3;
  }
  sim::RigVariation variation{.seed = static_cast<std::uint64_t>(std::atoll(argv[2]))};
  if (argc > 3) {
    if (const auto set = sim::set_by_name(variation, sim::kRigVariationNames, argv[3]); !set) {
      fmt::print(stderr, "calibration_error: {}\n", set.error().message);
      return 3;
    }
  }
  constexpr double kFull = 1.0;
  const auto rig =
      variation.seed == 0 ? sim::DrawnRig{.geometry = sim::default_rig(kFull)} : sim::draw_rig(variation, kFull);
  const CalibrationError error = calibration_error(*calibration, rig.geometry);
  fmt::print("{{\"rms_um\": {:.4f}, \"max_um\": {:.4f}, \"scale_ppm\": {:.2f}, \"predicted_um\": {:.4f}}}\n",
             error.rms_um, error.max_um, error.scale_ppm, calibration->quality ? calibration->quality->volume_um : 0.0);
  return 0;
}
