// bench_d415 FOLDER: matches the real D415 dot pair and prints what d415_measure.h defines, as JSON.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "tests/bench/real_data/d415_measure.h"

namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "null"; }

std::string json(const scanrig::bench::D415Measure& m) {
  return fmt::format(R"({{"rms_px": {}, "coverage": {}, "rim_smeared_px": {}, "rim_bridged_px": {}}})",
                     number(m.rms_px), number(m.coverage), number(m.rim_smeared_px), number(m.rim_bridged_px));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: bench_d415 FOLDER\n");
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  const auto result = scanrig::bench::measure_d415(argv[1]);
  if (!result) {
    fmt::print(stderr, "{}\n", result.error().message);
    return static_cast<int>(scanrig::exit_code(result.error().code));
  }
  fmt::print(R"({{"ours": {}, "sgbm": {}, "rim_rays": {}, "seconds": {:.2f}}})", json(result->ours), json(result->sgbm),
             result->rim_rays, result->seconds);
  fmt::print("\n");
  return 0;
}
