#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <filesystem>
#include <cstdlib>

#include "core/units.h"
#include "tests/component/closure/shot_scene.h"
#include "pipeline/closure/compare_views.h"

using namespace scanrig;
using namespace scanrig::sim;

std::vector<Disturbance> all() {
  std::vector<Disturbance> d{{.name = "unmoved"}, {.name = "unmoved_b"}, {.name="table0.006", .table_deg=0.006},{.name="table0.02", .table_deg=0.02}};
  for (double mm : {0.03, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0}) {
    d.push_back({.name = fmt::format("x{}mm", mm), .object = small_motion({0,0,0}, {mm,0,0})});
    d.push_back({.name = fmt::format("z{}mm", mm), .object = small_motion({0,0,0}, {0,0,mm})});
  }
  for (double deg : {0.03, 0.05, 0.1, 0.2, 0.5, 1.0}) {
    d.push_back({.name = fmt::format("turn{}deg", deg), .object = small_motion({0,to_radians(deg),0}, {0,0,0})});
    d.push_back({.name = fmt::format("tip{}deg", deg), .object = small_motion({to_radians(deg),0,0}, {0,0,0})});
    d.push_back({.name = fmt::format("table{}deg", deg), .table_deg = deg});
  }
  for (double deg : {0.002, 0.005, 0.01, 0.05, 0.2}) d.push_back({.name = fmt::format("camera{}deg", deg), .camera = small_motion({0, to_radians(deg), 0}, {0,0,0})});
  d.push_back({.name = "camera_roll0.05", .camera = small_motion({0,0,to_radians(0.05)}, {0,0,0})});
  d.push_back({.name = "x20mm", .object = small_motion({0,0,0}, {20,0,0})});
  return d;
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const std::string what = argv[1];
  const double scale = std::atof(argv[2]);
  const std::filesystem::path out = argv[3];
  std::filesystem::create_directories(out);
  Object object = what == "pebble" ? pebble() : *load_object(what == "figurine" ? "" : what, 100);
  if (what == "figurine_grey") return 2;
  ShotScene scene(std::move(object), scale);
  for (bool left : {true, false}) {
    const std::string side = left ? "L" : "R";
    const cv::Mat first = scene.look({}, left);
    const Sensor sensors[] = {{}, {.blur_px = 1.5}, {.noise_grey = 6}, {.light = 0.95}};
    const char* names[] = {"good", "blur", "noisy", "dim"};
    for (int s = 0; s < 4; ++s)
      cv::imwrite(out / fmt::format("{}_{}_before.png", side, names[s]), ShotScene::shoot(first, 1, s == 3 ? Sensor{} : sensors[s]));
    std::uint64_t noise = 100;
    for (const auto& d : all()) {
      const cv::Mat now = scene.look(d, left);
      for (int s = 0; s < 4; ++s) {
        const bool wanted = s == 0 || d.name.starts_with("unmoved") || d.name.ends_with("0.1mm") || d.name.ends_with("0.05mm") || d.name == "table0.006" || d.name.ends_with("n0.05deg");
        if (!wanted) continue;
        for (int k = 0; k < (d.name == "unmoved" ? 20 : 1); ++k) {
          const cv::Mat after = ShotScene::shoot(now, ++noise, sensors[s]);
          const cv::Mat before = cv::imread(out / fmt::format("{}_{}_before.png", side, names[s]));
          const auto c = compare_views(before, after);
          fmt::print("{} {} {} {} {:.3f} {:.3f} {}\n", what, side, names[s], d.name, c->shift_px, c->changed, c->features);
          cv::imwrite(out / fmt::format("{}_{}_{}_{}.png", side, names[s], d.name, k), after);
        }
      }
    }
    std::fflush(stdout);
  }
}
