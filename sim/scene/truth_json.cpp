#include "sim/scene/truth_json.h"

#include <nlohmann/json.hpp>

namespace scanrig::sim {

using nlohmann::ordered_json;

ordered_json transform_json(const Transform& t) {
  ordered_json rotation = ordered_json::array();
  for (int i = 0; i < 3; ++i) rotation.push_back({t.linear()(i, 0), t.linear()(i, 1), t.linear()(i, 2)});
  return {{"rotation", rotation}, {"translation", {t.translation().x(), t.translation().y(), t.translation().z()}}};
}

ordered_json lens_json(const Eye& eye) {
  return {{"width", eye.width}, {"height", eye.height}, {"fx", eye.fx}, {"fy", eye.fy}, {"cx", eye.cx}, {"cy", eye.cy}};
}

ordered_json camera_json(const Eye& eye) {
  ordered_json json = {{"serial", eye.serial}};
  json.update(lens_json(eye));
  json["distortion"] = eye.distortion;
  json["camera_from_turntable"] = transform_json(eye.eye_from_turntable);
  return json;
}

namespace {

ordered_json rows(const Eigen::Matrix4d& m) {
  ordered_json json = ordered_json::array();
  for (int i = 0; i < 4; ++i) json.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return json;
}

ordered_json whole_camera(const Eye& eye) {
  ordered_json json = camera_json(eye);
  if (eye.residual) json["lens_residual"] = {{"du", rows(eye.residual->du)}, {"dv", rows(eye.residual->dv)}};
  return json;
}

}  // namespace

ordered_json profile_json(const ChosenProfile& chosen) {
  if (chosen.effects.is_none()) return ordered_json::object();
  ordered_json effects = ordered_json::object();
  for (const Effect& effect : workshop_effects()) {
    for (const auto& size : effect.sizes) effects[size.name] = chosen.effects.*size.member;
  }
  return {{"profile", "workshop"},        {"profile_sha256", chosen.sha256()}, {"material", chosen.material_name()},
          {"gamma", chosen.coding.gamma}, {"is_cold", chosen.is_cold},         {"effects", effects}};
}

ordered_json rig_json(const DrawnRig& rig) {
  const TableErrors& t = rig.table;
  ordered_json dots = ordered_json::array();
  for (int i = 0; i < kRimDots; ++i) {
    const Eigen::Vector2d at = rim_dot_centre(i) + rig.rim_dots[i];
    const Eigen::Vector3d in_axis_frame = t.axis_from_top * Eigen::Vector3d(at.x(), 0.0, at.y());
    dots.push_back({in_axis_frame.x(), in_axis_frame.y(), in_axis_frame.z()});
  }
  return {
      {"left", whole_camera(rig.geometry.left)},
      {"right", whole_camera(rig.geometry.right)},
      {"table",
       {{"reversed", t.reversed},
        {"gear_factor", t.gear_factor},
        {"angle_amplitude_deg", t.amplitude_deg},
        {"angle_phase_rad", t.phase_rad},
        {"runout_mm", t.runout_mm},
        {"axis_from_top", transform_json(t.axis_from_top)},
        {"axis", {{"runout_mm", t.axis.runout_mm}, {"wobble_rad", t.axis.wobble_rad}, {"worm_deg", t.axis.worm_deg}}}}},
      {"rim_dots", dots},
      {"noise_factor", rig.noise_factor}};
}

}  // namespace scanrig::sim
