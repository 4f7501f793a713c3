// movement_shots SCALE OBJECT...: results of the movement check on rendered views, for each object (`figurine`,
// `pebble` or a file), for every change that may have happened since view 0. A line: object, sensor, change, amount,
// the shift in px, the changed share, moved or unmoved; the worse of both cameras.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/units.h"
#include "pipeline/movement/compare_views.h"
#include "tests/component/movement/shot_scene.h"

namespace scanrig::sim {
namespace {

struct Case {
  std::string what;
  double amount;  ///< mm or degrees
  Disturbance since;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const double deg : {0.0, 0.006, 0.02}) all.push_back({"unmoved, table off by deg", deg, {.table_deg = deg}});
  for (const double mm : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0}) {
    all.push_back({"slipped along x, mm", mm, {.object = small_motion({0, 0, 0}, {mm, 0, 0})}});
    all.push_back({"slipped along z, mm", mm, {.object = small_motion({0, 0, 0}, {0, 0, mm})}});
  }
  for (const double deg : {0.05, 0.1, 0.2, 0.5, 1.0}) {
    all.push_back({"turned, deg", deg, {.object = small_motion({0, to_radians(deg), 0}, {0, 0, 0})}});
    all.push_back({"tipped, deg", deg, {.object = small_motion({to_radians(deg), 0, 0}, {0, 0, 0})}});
    all.push_back({"lost steps, deg", deg, {.table_deg = deg}});
  }
  for (const double deg : {0.002, 0.005, 0.01, 0.02}) {
    all.push_back({"camera knocked, deg", deg, {.camera = small_motion({0, to_radians(deg), 0}, {0, 0, 0})}});
  }
  return all;
}

struct NamedSensor {
  const char* name;
  Sensor sensor;
};

constexpr NamedSensor kSensors[] = {{"as simulated", {}},
                                    {"blurred by 1.5 px", {.blur_px = 1.5}},
                                    {"4 grey more noise", {.noise_grey = 4.0}},
                                    {"5 % less light", {.light = 0.95}}};

/// The worse of both cameras; `noise` names the exposures.
ViewChange worse(const cv::Mat (&before)[2], const cv::Mat (&now)[2], std::uint64_t noise, const NamedSensor& with) {
  ViewChange worst;
  const Sensor first{.blur_px = with.sensor.blur_px, .noise_grey = with.sensor.noise_grey};
  for (const int side : {0, 1}) {
    const auto change = compare_views(ShotScene::shoot(before[side], 2 * noise + 1, first),
                                      ShotScene::shoot(now[side], 2 * noise + 2, with.sensor));
    if (!change) std::exit(1);
    worst.shift_px = std::max(worst.shift_px, change->shift_px);
    worst.changed = std::max(worst.changed, change->changed);
    worst.unmoved = worst.unmoved && change->unmoved;
  }
  return worst;
}

void measure(const std::string& name, double scale) {
  auto object = name == "pebble" ? Result<Object>(pebble()) : load_object(name == "figurine" ? "" : name, 100.0);
  if (!object) {
    fmt::print(stderr, "{}\n", object.error().message);
    std::exit(1);
  }
  const std::string title = object->name;
  const ShotScene scene(std::move(*object), scale);
  const cv::Mat before[2] = {scene.look({}, true), scene.look({}, false)};
  std::uint64_t noise = 0;
  for (const auto& one : cases()) {
    const cv::Mat now[2] = {scene.look(one.since, true), scene.look(one.since, false)};
    const bool still = one.what.starts_with("unmoved");
    for (const auto& with : kSensors) {
      if (!still && &with != &kSensors[0]) break;
      for (int i = 0; i < (still ? 10 : 2); ++i) {
        const auto change = worse(before, now, ++noise, with);
        fmt::print("{}\t{}\t{}\t{}\t{:.3f}\t{:.3f}\t{}\n", title, with.name, one.what, one.amount, change.shift_px,
                   change.changed, change.unmoved ? "unmoved" : "moved");
      }
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace scanrig::sim

int main(int count, char** words) {
  const double scale = count > 2 ? std::atof(words[1]) : 0.0;
  if (scale <= 0.0) {
    fmt::print(stderr, "usage: movement_shots SCALE OBJECT...\n");
    return 2;
  }
  for (int i = 2; i < count; ++i) scanrig::sim::measure(words[i], scale);
  return 0;
}
