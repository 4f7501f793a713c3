// bench_range scan|peers|middlebury|d415 FOLDER [ROWS_PX]: the range stage against a known truth, as JSON;
// rows of the right images are moved by a smooth field of up to ROWS_PX. See rendered_scan.h, peers.h and real_pair.h.

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/bench/range/peers.h"
#include "tests/bench/range/real_pair.h"
#include "tests/bench/range/rendered_scan.h"

int main(int argc, char** argv) {
  using namespace scanrig;
  const std::string what = argc >= 3 ? argv[1] : "";
  if (what != "scan" && what != "peers" && what != "middlebury" && what != "d415") {
    fmt::print(stderr, "usage: bench_range scan|peers|middlebury|d415 FOLDER [ROWS_PX]\n");
    return static_cast<int>(ExitCode::usage);
  }
  const double rows_px = argc > 3 ? std::atof(argv[3]) : 0.0;
  const auto json = what == "scan"         ? bench::measure_scan(argv[2], rows_px)
                    : what == "peers"      ? bench::measure_peers(argv[2])
                    : what == "middlebury" ? bench::measure_middlebury(argv[2], rows_px)
                                           : bench::measure_sheet(argv[2], rows_px);
  if (!json) {
    fmt::print(stderr, "{}\n", json.error().message);
    return static_cast<int>(exit_code(json.error().code));
  }
  fmt::print("{}\n", json->dump(1));
  return 0;
}
