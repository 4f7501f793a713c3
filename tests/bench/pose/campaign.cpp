/// Trials of finding how an object was turned over, each a line of JSON. The truth is only compared with.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/model_io/mesh_reader.h"
#include "tests/bench/pose/campaign_symmetric.h"
#include "tests/bench/pose/campaign_trial.h"

namespace {

using namespace scanrig;
using namespace scanrig::campaign;

constexpr int kUpsideDownEvery = 4, kDrawnPerFile = 4;
constexpr int kDrawsOfAnObject = 20;
constexpr double kMinSizeMm = 70.0, kMaxSizeMm = 112.0;

/// sigma of a pixel's depth where the texture is good, times these, is the height of the bumps.
constexpr std::array kBumpSigmas = {1.0, 2.0, 3.0, 5.0};
constexpr double kDepthSigmaMm = 0.012;

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

/// One draw of an object, and what becomes of it.
using Draw = Result<nlohmann::json> (*)(int trial, const Arguments& arguments, Chance& chance);

Result<nlohmann::json> flipped(int trial, const Arguments& arguments, Chance& chance) {
  TrialOptions options;
  if (trial % kUpsideDownEvery == 0) options.flip = Flip::upside_down;
  options.tries_generators = arguments.generators_every > 0 && trial % arguments.generators_every == 1;
  return run_trial(object_of(trial, arguments, chance), options, chance);
}

Result<nlohmann::json> symmetric(int kind, double bump_mm, Chance& chance) {
  const SymmetricObject object = draw_symmetric(kind, chance.between(kMinSizeMm, kMaxSizeMm), bump_mm, chance);
  TrialOptions options;
  options.flip = Flip::any;
  auto result = run_trial(object.drawn, options, chance);
  if (result) (*result)["made"] = {{"group", object.group}, {"fold", object.fold}, {"bump_mm", bump_mm}};
  return result;
}

Result<nlohmann::json> symmetric_as_made(int trial, const Arguments& /*arguments*/, Chance& chance) {
  return symmetric(trial % symmetric_kinds(), 0.0, chance);
}

Result<nlohmann::json> symmetric_with_a_bump(int trial, const Arguments& /*arguments*/, Chance& chance) {
  const double sigmas = kBumpSigmas.at(static_cast<std::size_t>(trial) % kBumpSigmas.size());
  return symmetric(bumped_kind(trial), sigmas * kDepthSigmaMm, chance);
}

Result<nlohmann::json> not_turned_over(int trial, const Arguments& arguments, Chance& chance) {
  TrialOptions options;
  options.flip = Flip::none;
  return run_trial(object_of(trial, arguments, chance), options, chance);
}

Result<nlohmann::json> another_object(int trial, const Arguments& arguments, Chance& chance) {
  const DrawnObject one = object_of(trial, arguments, chance);
  DrawnObject another = object_of(trial + kUpsideDownEvery, arguments, chance);
  while (another.name == one.name) another = object_of(trial + kUpsideDownEvery, arguments, chance);
  TrialOptions options;
  options.another = &another;
  return run_trial(one, options, chance);
}

constexpr std::array<std::pair<const char*, Draw>, 5> kSeries = {{{"flips", flipped},
                                                                  {"symmetric", symmetric_as_made},
                                                                  {"bumps", symmetric_with_a_bump},
                                                                  {"not-turned-over", not_turned_over},
                                                                  {"another-object", another_object}}};

nlohmann::json trial_of(int trial, Draw draw, const Arguments& arguments) {
  Chance chance(arguments.seed * 1000003U + static_cast<std::uint64_t>(trial));
  std::string why;
  for (int k = 0; k < kDrawsOfAnObject; ++k) {
    auto result = draw(trial, arguments, chance);
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
  const auto* const series = argc < 2 ? kSeries.end() : std::ranges::find_if(kSeries, [&](const auto& each) {
    return std::string_view(each.first) == argv[1];
  });
  if (argc < 6 || series == kSeries.end()) {
    fmt::print(stderr, "usage: bench_campaign SERIES SEED FIRST COUNT GENERATORS_EVERY MESH...\n");
    return static_cast<int>(ExitCode::usage);
  }
  Arguments arguments{
      std::strtoull(argv[2], nullptr, 10), std::atoi(argv[3]), std::atoi(argv[4]), std::atoi(argv[5]), {}};
  for (const char* file : std::span(argv + 6, static_cast<std::size_t>(argc - 6))) {
    auto mesh = read_mesh(file);
    if (!mesh) {
      fmt::print(stderr, "{}\n", mesh.error().message);
      return static_cast<int>(exit_code(mesh.error().code));
    }
    arguments.files.push_back({file, joined_vertices(*mesh)});
  }
  with_threads(1, [&] {
    for (int trial = arguments.first; trial < arguments.first + arguments.count; ++trial) {
      fmt::print("{}\n", trial_of(trial, series->second, arguments).dump());
      std::fflush(stdout);
    }
  });
  return 0;
}
