/// Trials of finding how an object was turned over, each a line of JSON. The truth is only compared with.
#include <fmt/format.h>

#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/model_io/mesh_reader.h"
#include "tests/bench/pose/campaign_trial.h"

namespace {

using namespace scanrig;
using namespace scanrig::campaign;

constexpr int kUpsideDownEvery = 4, kDrawnPerFile = 4;
constexpr int kDrawsOfAnObject = 20;
constexpr double kMinSizeMm = 70.0, kMaxSizeMm = 112.0;

struct Arguments {
  std::uint64_t seed = 0;
  int first = 0, count = 0, generators_every = 0;
  std::vector<DrawnObject> files;
};

/// A mesh of a file every so often, else a drawn one.
DrawnObject object_of(int trial, const Arguments& arguments, Chance& chance) {
  const double size = chance.between(kMinSizeMm, kMaxSizeMm);
  const auto kinds = object_kinds(), files = static_cast<int>(arguments.files.size());
  const int choice = chance.among(kinds * kDrawnPerFile + files * kDrawnPerFile);
  if (choice < kinds * kDrawnPerFile) return draw_object((trial / kUpsideDownEvery + choice) % kinds, size, chance);
  DrawnObject object = arguments.files[static_cast<std::size_t>(choice % files)];
  scale_to(object.mesh, size);
  return object;
}

nlohmann::json trial_of(int trial, const Arguments& arguments) {
  Chance chance(arguments.seed * 1000003U + static_cast<std::uint64_t>(trial));
  TrialOptions options;
  options.is_upside_down = trial % kUpsideDownEvery == 0;
  options.tries_generators = arguments.generators_every > 0 && trial % arguments.generators_every == 1;
  std::string why;
  for (int draw = 0; draw < kDrawsOfAnObject; ++draw) {
    const DrawnObject object = object_of(trial, arguments, chance);
    auto result = run_trial(object, options, chance);
    if (result) {
      (*result)["trial"] = trial;
      return *result;
    }
    why = result.error().message;
  }
  return {{"trial", trial}, {"verdict", "not drawn"}, {"message", why}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: bench_campaign SEED FIRST COUNT GENERATORS_EVERY MESH...\n");
    return static_cast<int>(ExitCode::usage);
  }
  Arguments arguments{
      std::strtoull(argv[1], nullptr, 10), std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4]), {}};
  for (const char* file : std::span(argv + 5, static_cast<std::size_t>(argc - 5))) {
    auto mesh = read_mesh(file);
    if (!mesh) {
      fmt::print(stderr, "{}\n", mesh.error().message);
      return static_cast<int>(exit_code(mesh.error().code));
    }
    arguments.files.push_back({file, joined_vertices(*mesh)});
  }
  with_threads(1, [&] {
    for (int trial = arguments.first; trial < arguments.first + arguments.count; ++trial) {
      fmt::print("{}\n", trial_of(trial, arguments).dump());
      std::fflush(stdout);
    }
  });
  return 0;
}
