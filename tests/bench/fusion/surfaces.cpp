// bench_surfaces TRUTH.ply MESH.ply...: how far each surface lies from the true one, by one rule for all, as JSON.
// Points are spread evenly over what a surface claims to have measured, which is all of it where its file does not say.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/statistics.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/mesh/surface_samples.h"
#include "pipeline/model_io/mesh_reader.h"

namespace {

using namespace scanrig;

constexpr std::size_t kSamples = 200'000;
constexpr double kFarMm = 0.25, kCoveredMm = 0.1;

std::vector<double> distances(const SurfaceIndex& surface, const std::vector<SurfaceSample>& samples) {
  constexpr std::size_t kBlock = 1000;
  std::vector<double> found(samples.size());
  parallel_for((samples.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t i = block * kBlock; i < std::min(samples.size(), (block + 1) * kBlock); ++i) {
      found[i] = surface.nearest(samples[i].point).distance;
    }
  });
  return found;
}

double share(const std::vector<double>& values, double limit) {
  const auto below = std::count_if(values.begin(), values.end(), [limit](double value) { return value <= limit; });
  return static_cast<double>(below) / static_cast<double>(values.size());
}

Result<nlohmann::json> measure(const std::string& true_file, const std::vector<std::string>& files) {
  const auto truth = read_ply(true_file);
  if (!truth) return pass_on(truth);
  const auto true_surface = SurfaceIndex::create(*truth);
  if (!true_surface) return pass_on(true_surface);
  const auto true_samples = sample_surface(*truth, measured_faces(*truth, true), kSamples);
  nlohmann::json json;
  for (const std::string& file : files) {
    const auto mesh = read_ply(file);
    if (!mesh) return pass_on(mesh);
    const auto faces = measured_faces(*mesh, true);
    const auto surface = SurfaceIndex::create(*mesh, faces);
    if (!surface) return pass_on(surface, file);
    const auto off = distances(*true_surface, sample_surface(*mesh, faces, kSamples));
    json.push_back({{"faces", mesh->faces.size()},
                    {"measured_faces", faces.size()},
                    {"median_mm", quantile(off, 0.5)},
                    {"p95_mm", quantile(off, 0.95)},
                    {"beyond", 1.0 - share(off, kFarMm)},
                    {"covered", share(distances(*surface, true_samples), kCoveredMm)}});
  }
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: bench_surfaces TRUTH.ply MESH.ply...\n");
    return static_cast<int>(ExitCode::usage);
  }
  const auto json = measure(argv[1], {argv + 2, argv + argc});
  if (!json) {
    fmt::print(stderr, "{}\n", json.error().message);
    return static_cast<int>(exit_code(json.error().code));
  }
  fmt::print("{}\n", json->dump(1));
  return 0;
}
