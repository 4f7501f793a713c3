#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "sim/scene/profile.h"

namespace scanrig::sim {

/// Sizes of what light, optics and mechanics do beyond profile 1. As declared each is that of profile 1: no effect.
/// Pixels are those of the full sensor, grey levels of 255.
/// To add an effect: 1. its sizes here, 2. an entry in effects.cpp, 3. the code that reads the sizes, with its test.
struct Effects {
  // Lenses
  double blur_centre_px = Profile{}.lens_sigma_px;  ///< sigma
  double blur_corner_px = Profile{}.lens_sigma_px;
  double astigmatism = 1.0;                  ///< radial by tangential sigma in the corner
  double lens_difference = 0.0;              ///< of the two lenses' blur, as a share
  double focus_difference_mm = 0.0;          ///< between the planes on which the two lenses focus
  double chromatic_px = 0.0;                 ///< red against blue in the corner
  double lens_residual_px = 0.0;             ///< rms of what Brown's model cannot follow, see LensResidual
  double vignetting = Profile{}.vignetting;  ///< loss in the corner
  double vignetting_off_px = 0.0;            ///< of its middle from the image's

  // Sensors
  double gain_difference = 0.0;   ///< of left and right, as a share
  double prnu = 0.0;              ///< sigma of the pixels' gains, as a share
  double column_grey = 0.0;       ///< sigma of the columns' offsets
  double hot_pixels = 0.0;        ///< share of all
  double black_grey = 0.0;        ///< level without light
  double black_drift_grey = 0.0;  ///< amplitude, from exposure to exposure
  double cross_talk = 0.0;        ///< share of a pixel's light that its four neighbours get

  // Projector
  double falloff = 0.0;                                ///< loss in the raster's corner
  double flash = 0.0;                                  ///< sigma from flash to flash, as a share
  double projector_black = Profile{}.projector_black;  ///< light between the dots, share of a dot's
  double dot_rounding_px = 0.0;                        ///< sigma, projector pixels, beside the lens's own
  double interreflection = 0.0;                        ///< share of the one diffuse bounce that is rendered

  // Materials: share of what the material has
  double gloss = 0.0;
  double translucency = 0.0;

  // Turntable
  double runout_mm = 0.0;      ///< radial, each way, first and second harmonic together
  double wobble_deg = 0.0;     ///< likewise, about both horizontal axes
  double worm_deg = 0.0;       ///< amplitude of the angle's error
  double top_tilt_deg = 0.0;   ///< of the table top against the axis
  double top_height_mm = 0.0;  ///< above where boards of a calibration show it: they sink into it

  // From cold to warm
  double drift_px = 0.0;           ///< turn of the cameras against each other
  double drift_baseline_mm = 0.0;  ///< growth

  // Room
  double folds = 0.0;          ///< of the screen: largest change of its brightness, each way
  double folds_dark = 0.0;     ///< mean loss of brightness in the folds
  double screen_shadow = 0.0;  ///< share of shadow and colour that the object throws on the screen
  double table_gloss = 0.0;    ///< mirrored share, as cameras 15 to 30 degrees above see it
  double flicker = 0.0;        ///< sigma of the ambient light from exposure to exposure, as a share

  double room_light = 0.0;        ///< plain light in the pattern's exposure, as a share of a plain exposure's
  double pattern_exposure = 1.0;  ///< of the pattern, as a share of profile 1's

  // Handling, in one view
  double creep_mm = 0.0;
  double rock_deg = 0.0;
  double finger = 0.0;       ///< share of the projector's light that a finger takes
  double overexposed = 0.0;  ///< by how much the view is brighter, as a share
  double sticker = 0.0;      ///< 1: a patch of the object has the screen's colour
  double shadow = 0.0;       ///< share of the white light that a patch of the object loses: only the screen lights it

  bool operator==(const Effects&) const = default;
  /// Whether every size is that of profile 1.
  [[nodiscard]] bool is_none() const { return *this == Effects{}; }
};

/// How the sensor's values are written.
struct PixelCoding {
  int bits = 8;        ///< 8: CV_8U; 12: CV_16U, 0 to 4095
  double gamma = 1.0;  ///< exponent of full scale's share: 0.45 in many V4L2 cameras

  bool operator==(const PixelCoding&) const = default;
};

/// What stands behind the object, and the table's colour.
enum class ScreenColour { blue, green, none };

/// What is chosen of a profile.
struct ChosenProfile {
  Effects effects{};
  std::string material{};  ///< of materials.h; empty: the profile's own, matt without gloss of profile 1, satin of 2
  PixelCoding coding{};
  ScreenColour screen = ScreenColour::blue;
  bool is_cold = false;  ///< cameras are switched on with the first exposure; else warm

  /// SHA-256 of profile, effects and material.
  [[nodiscard]] std::string sha256() const;
  [[nodiscard]] std::string material_name() const;
};

/// One effect of profile 2 by name.
struct Effect {
  struct Size {
    const char* name;
    double Effects::*member;
    double value;  ///< in profile 2
  };
  std::string_view family, name;
  std::vector<Size> sizes;
  bool is_asked_for = false;  ///< on only where its name or family is given
};

/// The effects of profile 2, "workshop", in the order of the table in docs/reference/simulated-rig.md.
const std::vector<Effect>& workshop_effects();

/// Chooses a profile, "laboratory" or 1, "workshop" or 2; of that one all but those in `without`, and of those that are
/// asked for only those in `with`. Both: names of effects or families, separated
/// by commas. Fails with `not_found` (no such name; lists those there are), `invalid_input` (profile 1 has no effects).
Result<Effects> choose_effects(std::string_view profile, std::string_view without, std::string_view with);

/// Name and value of every constant of a profile: canonical_text() of profile 1, then what profile 2 adds.
std::string canonical_text(const ChosenProfile& chosen);

}  // namespace scanrig::sim
