#pragma once

#include <string>

namespace scanrig::sim {

/// Everything about the simulated rig that a measurement depends on. Frozen: a change of any number is a new version.
/// Lengths in mm, angles in degrees, pixels of the full 1280x960 sensor; brightness 1.0 = full scale, linear light.
struct Profile {
  int version = 1;

  // Cameras: symmetric about the optical mid-line, both looking at (0, aim_height, 0).
  int width = 1280;
  int height = 960;
  double focal_px = 16.0 / 0.00375;
  double elevation_deg = 22.0;
  double distance_mm = 640.0;
  double baseline_mm = 160.0;
  double aim_height_mm = 45.0;
  double focal_difference_px = 2.4;  ///< right minus left: no two lenses are the same
  double principal_left_px[2] = {637.2, 481.1};
  double principal_right_px[2] = {641.9, 478.4};
  double distortion_left[5] = {-0.080, 0.15, 1.2e-4, -0.9e-4, 0.0};
  double distortion_right[5] = {-0.084, 0.17, -0.8e-4, 1.1e-4, 0.0};
  double lens_sigma_px = 0.6;           ///< the same all over the field
  double defocus_px_per_mm = 0.0054;    ///< sigma per mm off the focus plane: 1.3 px circle at 60 mm
  double vignetting = 0.12;             ///< loss in the corner
  double read_noise = 0.8;              ///< grey levels
  double shot_noise_variance = 0.0263;  ///< grey levels squared per grey level: 2 levels in all at 128

  // Projector: above the midpoint of the cameras, looking at the same point.
  int projector_width = 1920;
  int projector_height = 1080;
  double projector_above_mm = 90.0;
  double projector_focal_px = 4526.0;            ///< 0.15 mm per mirror at the aim point
  double projector_sigma_px = 0.7;               ///< its lens, in its own pixels
  double projector_defocus_px_per_mm = 0.006;    ///< sigma, sharp over +-60 mm
  double dot_diameters_px[3] = {3.0, 2.0, 5.0};  ///< camera pixels, whatever the image scale
  double dot_shares[3] = {0.6, 0.25, 0.15};      ///< of the number of dots
  double dot_coverage = 0.5;
  unsigned dot_seed = 20021204;

  // Light. Full scale of the sensor is reached by irradiance * albedo = 1.
  double ambient = 0.48;            ///< sky above, plain exposure
  double broad_lights = 0.50;       ///< three soft boxes together, plain exposure
  double pattern_room_light = 0.1;  ///< share of the plain light that stays on while the projector shines
  double projector_light = 0.68;    ///< on a surface that faces it at the aim point
  double projector_black = 0.02;    ///< light between the dots, share of a dot's

  // Blue table and backdrop: linear RGB albedo.
  double table_radius_mm = 90.0;
  double table_albedo[3] = {0.035, 0.085, 0.46};
  double rim_dot_albedo[3] = {0.08, 0.16, 0.60};
  double rim_dot_radius_mm = 84.5;
  double rim_dot_diameter_mm = 2.4;
  double backdrop_albedo[3] = {0.040, 0.095, 0.50};
  double backdrop_distance_mm = 220.0;  ///< behind the aim point, across the mid-line

  // Turntable.
  double speed_deg_s = 45.0;
  double acceleration_deg_s2 = 90.0;
  double settling_s = 0.2;
  double vibration_deg = 0.02;       ///< amplitude at the end of a move; dies out within settling_s
  double repeatability_deg = 0.003;  ///< sigma of the axis's rest position
  double encoder_step_deg = 0.004;
  double exposure_s = 0.012;

  // Working volume.
  double largest_diameter_mm = 115.0;
  double largest_height_mm = 115.0;
};

/// The only profile.
const Profile& profile();

/// Name and value of every constant, one per line.
std::string canonical_text(const Profile& profile);

/// SHA-256 of the canonical text of profile().
std::string profile_sha256();

}  // namespace scanrig::sim
