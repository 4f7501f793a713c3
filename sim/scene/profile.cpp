#include "sim/scene/profile.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/hash.h"

namespace scanrig::sim {

const Profile& profile() {
  static const Profile the_profile;
  return the_profile;
}

std::string canonical_text(const Profile& p) {
  std::string text = fmt::format("scanrig simulated rig, profile version {}\n", p.version);
  const auto add = [&text](const char* name, const auto&... values) {
    text += name;
    ((text += fmt::format(" {}", values)), ...);
    text += '\n';
  };
  const auto list = [](const auto& values) { return fmt::format("{}", fmt::join(values, " ")); };
  add("sensor", p.width, p.height, p.focal_px, p.focal_difference_px);
  add("geometry", p.elevation_deg, p.distance_mm, p.baseline_mm, p.aim_height_mm);
  add("principal", list(p.principal_left_px), list(p.principal_right_px));
  add("distortion", list(p.distortion_left), list(p.distortion_right));
  add("lens", p.lens_sigma_px, p.defocus_px_per_mm, p.vignetting);
  add("noise", p.read_noise, p.shot_noise_variance);
  add("response linear, no gamma, 8 bit, BayerRG8");
  add("projector", p.projector_width, p.projector_height, p.projector_above_mm, p.projector_focal_px);
  add("projector_lens", p.projector_sigma_px, p.projector_defocus_px_per_mm);
  add("dots", list(p.dot_diameters_px), list(p.dot_shares), p.dot_coverage, p.dot_seed);
  add("light", p.ambient, p.broad_lights, p.pattern_room_light, p.projector_light, p.projector_black);
  add("table", p.table_radius_mm, list(p.table_albedo));
  add("rim_dots", list(p.rim_dot_albedo), p.rim_dot_radius_mm, p.rim_dot_diameter_mm);
  add("backdrop", list(p.backdrop_albedo), p.backdrop_distance_mm);
  add("turntable", p.speed_deg_s, p.acceleration_deg_s2, p.settling_s, p.vibration_deg, p.repeatability_deg,
      p.encoder_step_deg);
  add("exposure", p.exposure_s);
  add("working_volume", p.largest_diameter_mm, p.largest_height_mm);
  return text;
}

std::string profile_sha256() {
  static const std::string hash = sha256(canonical_text(profile()));
  return hash;
}

}  // namespace scanrig::sim
