// Profile 2, "workshop": every magnitude with its source, or the word assumed. Frozen: a changed number is a new
// version.
#include "sim/scene/effects.h"

#include <algorithm>

#include "core/hash.h"

namespace scanrig::sim {
namespace {

constexpr int kWorkshopVersion = 2;
constexpr std::string_view kHandling = "handling";

using E = Effects;

/// Of a list with commas, each name once through `use`, which says whether there is such a name.
template <class Use>
Result<void> for_each_name(std::string_view list, const Use& use) {
  while (!list.empty()) {
    const std::string_view name = list.substr(0, list.find(','));
    list.remove_prefix(std::min(list.size(), name.size() + 1));
    if (use(name)) continue;
    std::string names;
    for (const Effect& effect : workshop_effects()) names += fmt::format(" {}", effect.name);
    return fail(ErrorCode::not_found, "effect {}: no such name; choose from{}, or a family of them", name, names);
  }
  return {};
}

}  // namespace

const std::vector<Effect>& workshop_effects() {
  static const std::vector<Effect> effects = {
      // C-mount lenses of 16 mm on 3.75 um pixels: data sheets show an MTF of 50 % near 80 to 100 line pairs per mm in
      // the centre and half as many in the corner, which are these sigmas.
      {"optics", "blur", {{"blur_centre_px", &E::blur_centre_px, 0.5}, {"blur_corner_px", &E::blur_corner_px, 0.9}}},
      // Tangential and sagittal MTF of such data sheets part by about that much in the corner.
      {"optics", "astigmatism", {{"astigmatism", &E::astigmatism, 1.3}}},
      // Assumed: two samples of one lens, focused by hand.
      {"optics", "lens-pair", {{"lens_difference", &E::lens_difference, 0.2}}},
      {"optics", "focus", {{"focus_difference_mm", &E::focus_difference_mm, 4.0}}},
      // Data sheets of such lenses: 1 to 2 um of lateral colour at the edge of the field.
      {"optics", "chromatic", {{"chromatic_px", &E::chromatic_px, 0.3}}},
      // Assumed: left over after five coefficients, as in calibrations of such lenses.
      {"optics", "distortion", {{"lens_residual_px", &E::lens_residual_px, 0.05}}},
      // cos^4 of the field's 11 degrees gives 7 %, the rest is the mount; off-centre is assumed.
      {"optics",
       "vignetting",
       {{"vignetting", &E::vignetting, 0.15}, {"vignetting_off_px", &E::vignetting_off_px, 60.0}}},

      // Assumed: two cameras with the same gain setting.
      {"sensor", "gain", {{"gain_difference", &E::gain_difference, 0.04}}},
      // EMVA 1288 sheets of 3.75 um CMOS sensors: PRNU 0.4 to 1 %.
      {"sensor", "prnu", {{"prnu", &E::prnu, 0.008}}},
      // Assumed, as the profile of columns in EMVA 1288 sheets.
      {"sensor", "columns", {{"column_grey", &E::column_grey, 0.3}}},
      // Assumed: a sensor that is some years old, without correction.
      {"sensor", "hot-pixels", {{"hot_pixels", &E::hot_pixels, 1.0 / 20000.0}}},
      // Usual setting of the offset; its drift is assumed.
      {"sensor", "black-level", {{"black_grey", &E::black_grey, 2.0}, {"black_drift_grey", &E::black_drift_grey, 0.4}}},
      // Assumed: optical and electrical, small pixels without deep trenches.
      {"sensor", "cross-talk", {{"cross_talk", &E::cross_talk, 0.06}}},

      // DLP projectors: uniformity of 70 % or better.
      {"projector", "falloff", {{"falloff", &E::falloff, 0.3}}},
      // Assumed, of a pulsed light-emitting diode.
      {"projector", "flash", {{"flash", &E::flash, 0.03}}},
      // Assumed: a chequered DLP image, not full on to full off.
      {"projector", "contrast", {{"projector_black", &E::projector_black, 1.0 / 60.0}}},
      // Assumed: gaps and hinges of the mirrors, diffraction.
      {"projector", "rounding", {{"dot_rounding_px", &E::dot_rounding_px, 0.3}}},
      // Physics: what the albedos give.
      {"projector", "interreflection", {{"interreflection", &E::interreflection, 1.0}}},

      // See materials.cpp.
      {"materials", "gloss", {{"gloss", &E::gloss, 1.0}}},
      {"materials", "translucency", {{"translucency", &E::translucency, 1.0}}},

      // Data sheets of stepper rotary stages with worm gears: runout and wobble of that order.
      {"turntable", "runout", {{"runout_mm", &E::runout_mm, 0.010}}},
      {"turntable", "wobble", {{"wobble_deg", &E::wobble_deg, 0.003}}},
      // Likewise; one turn of the worm of a gear of 1:90 is 4 degrees.
      {"turntable", "worm", {{"worm_deg", &E::worm_deg, 0.01}}},
      // Assumed: a turned plate on a flange.
      {"turntable", "tilt", {{"top_tilt_deg", &E::top_tilt_deg, 0.02}}},
      // Assumed: a film, dust, the board's own thickness.
      {"turntable", "height", {{"top_height_mm", &E::top_height_mm, 0.05}}},

      // Aluminium grows by 23e-6 per kelvin: 160 mm by 10 um in 3 K. The turn is assumed.
      {"drift", "drift", {{"drift_px", &E::drift_px, 0.1}, {"drift_baseline_mm", &E::drift_baseline_mm, 0.010}}},

      // Brightness 0.7 to 1.1: assumed, a hung cloth.
      {"room", "folds", {{"folds", &E::folds, 0.2}, {"folds_dark", &E::folds_dark, 0.1}}},
      // Physics: what the albedos and the soft boxes give.
      {"room", "screen-shadow", {{"screen_shadow", &E::screen_shadow, 1.0}}},
      // Assumed: a painted or printed top; a polished one would mirror 10 % at the cameras' angle.
      {"room", "table-gloss", {{"table_gloss", &E::table_gloss, 0.03}}},
      // Assumed: lamps on the mains, exposures of 12 ms.
      {"room", "flicker", {{"flicker", &E::flicker, 0.02}}},

      // As in the pair of a D415, whose dots stand faintly in the room's infrared light; the exposure is shorter.
      {"room",
       "faint-dots",
       {{"room_light", &E::room_light, 2.4}, {"pattern_exposure", &E::pattern_exposure, 0.3}},
       true},

      // Assumed: what operators report.
      {kHandling, "creep", {{"creep_mm", &E::creep_mm, 0.05}}, true},
      {kHandling, "rock", {{"rock_deg", &E::rock_deg, 0.02}}, true},
      {kHandling, "finger", {{"finger", &E::finger, 0.9}}, true},
      {kHandling, "overexposed", {{"overexposed", &E::overexposed, 1.5}}, true},
      {kHandling, "sticker", {{"sticker", &E::sticker, 1.0}}, true},
      {kHandling, "shadow", {{"shadow", &E::shadow, 0.95}}, true},
  };
  return effects;
}

Result<Effects> choose_effects(std::string_view profile, std::string_view without, std::string_view with) {
  const bool is_workshop = profile == "workshop" || profile == "2";
  if (!is_workshop && profile != "laboratory" && profile != "1") {
    return fail(ErrorCode::not_found, "profile {}: no such profile; choose laboratory (1) or workshop (2)", profile);
  }
  if (!is_workshop && !(without.empty() && with.empty())) {
    return fail(ErrorCode::invalid_input, "profile {}: has no effects; give --profile workshop, too", profile);
  }
  Effects chosen;
  if (!is_workshop) return chosen;
  const auto set = [&](const Effect& effect, bool is_on) {
    for (const auto& size : effect.sizes) chosen.*size.member = is_on ? size.value : Effects{}.*size.member;
  };
  for (const Effect& effect : workshop_effects()) set(effect, !effect.is_asked_for);
  const auto set_named = [&](bool is_on) {
    return [&set, is_on](std::string_view name) {
      bool is_found = false;
      for (const Effect& effect : workshop_effects()) {
        if (name == effect.name || name == effect.family) set(effect, is_on), is_found = true;
      }
      return is_found;
    };
  };
  if (const auto done = for_each_name(without, set_named(false)); !done) return pass_on(done, "--without");
  if (const auto done = for_each_name(with, set_named(true)); !done) return pass_on(done, "--with");
  return chosen;
}

std::string ChosenProfile::material_name() const {
  if (!material.empty()) return material;
  return effects.is_none() ? "matt" : "satin";
}

std::string canonical_text(const ChosenProfile& chosen) {
  std::string text = canonical_text(profile());
  if (chosen.effects.is_none() && chosen.coding == PixelCoding() && chosen.material.empty() &&
      chosen.screen == ScreenColour::blue) {
    return text;
  }
  text += fmt::format("workshop, profile version {}\nmaterial {}\n", kWorkshopVersion, chosen.material_name());
  text += fmt::format("coding {} bit, gamma {}\n", chosen.coding.bits, chosen.coding.gamma);
  text += fmt::format("cold {}\n", chosen.is_cold);
  if (chosen.screen != ScreenColour::blue) {
    text += fmt::format("screen {}\n", chosen.screen == ScreenColour::green ? "green" : "none");
  }
  for (const Effect& effect : workshop_effects()) {
    for (const auto& size : effect.sizes) text += fmt::format("{} {}\n", size.name, chosen.effects.*size.member);
  }
  return text;
}

std::string ChosenProfile::sha256() const { return scanrig::sha256(canonical_text(*this)); }

}  // namespace scanrig::sim
