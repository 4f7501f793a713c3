#include "sim/apps/rig_options.h"

#include <cstdio>

namespace scanrig::sim {
namespace {

template <class Options, std::size_t N>
std::string listed(const std::array<NamedValue<Options>, N>& values) {
  const Options defaults;
  std::string text;
  for (const auto& value : values) {
    text += fmt::format("{}{}={}", text.empty() ? "" : ", ", value.name, defaults.*value.member);
  }
  return text;
}

}  // namespace

void DrawnRigOptions::add_to(CLI::App& app) {
  app.add_option("--rig-seed", seed, "Draw the rig at random; the same seed is the same rig. 0: the default rig")
      ->capture_default_str();
  app.add_option("--rig", changes, "How far it is off, NAME=NUMBER,...; by default " + listed(kRigVariationNames));
}

Result<std::optional<RigVariation>> DrawnRigOptions::variation() const {
  if (seed == 0 && !changes.empty()) {
    return fail(ErrorCode::invalid_input, "--rig changes a drawn rig: give --rig-seed, too");
  }
  if (seed == 0) return std::optional<RigVariation>();
  RigVariation variation;
  variation.seed = seed;
  if (const auto set = set_by_name(variation, kRigVariationNames, changes); !set) return pass_on(set, "--rig");
  return std::optional(variation);
}

void ProfileOptions::add_to(CLI::App& app, bool has_object) {
  app.add_option("--profile", profile, "laboratory (1): ideal light, lenses and mechanics; workshop (2): as they are")
      ->capture_default_str();
  app.add_option("--without", without,
                 "Effects of the workshop to leave out, NAME,...; docs/reference/simulated-rig.md");
  app.add_option("--gamma", gamma, "Exponent of the images' values, 0.45 as of many USB cameras")
      ->capture_default_str();
  app.add_flag("--cold", is_cold, "The cameras are switched on with the first exposure, and drift");
  if (!has_object) return;
  app.add_option("--with", with,
                 "Also faint-dots; what hands do to one view: creep, rock, finger, overexposed, sticker, shadow");
  app.add_option("--screen", screen, "Colour of screen and table: blue, green, or none for a grey room")
      ->capture_default_str();
  app.add_option("--material", material, "Of the object, of the workshop satin; several joined by + in patches");
}

Result<ChosenProfile> ProfileOptions::chosen() const {
  auto effects = choose_effects(profile, without, with);
  if (!effects) return pass_on(effects);
  if (effects->is_none() && (profile == "laboratory" || profile == "1") && (!material.empty() || is_cold)) {
    return fail(ErrorCode::invalid_input, "profile {}: has neither materials nor drift; give --profile workshop, too",
                profile);
  }
  if (!(gamma >= 0.3 && gamma <= 1.0)) {
    return fail(ErrorCode::out_of_range, "--gamma {}: choose 0.3 to 1", gamma);
  }
  ChosenProfile chosen{.effects = *effects, .material = material, .coding = {.gamma = gamma}, .is_cold = is_cold};
  if (screen != "blue" && screen != "green" && screen != "none") {
    return fail(ErrorCode::not_found, "--screen {}: choose blue, green or none", screen);
  }
  if (screen != "blue") chosen.screen = screen == "green" ? ScreenColour::green : ScreenColour::none;
  if (const auto known = Materials::named(chosen.material_name(), chosen.effects); !known) return pass_on(known);
  return chosen;
}

void ShootBoardOptions::add_to(CLI::App& app) {
  app.add_option("--out", folder, "The folder to make")->required();
  rig.add_to(app);
  profile.add_to(app, false);
  app.add_option("--seed", series.seed, "The print, how the board is put down, faults and noise")
      ->capture_default_str();
  app.add_option("--scale", series.image_scale, "Resolution, as a share of 1280x960")->capture_default_str();
  app.add_flag("!--no-noise", series.noise, "Leave the sensors' noise out");
  app.add_option("--board", board, "COLUMNSxROWS squares")->capture_default_str();
  app.add_option("--square-mm", series.board.square_mm, "Side of a square")->capture_default_str();
  app.add_option("--marker-mm", series.board.marker_mm, "Side of a marker; 0: a plain chessboard")
      ->capture_default_str();
  app.add_option("--print", print, "Errors of the print, NAME=NUMBER,...; by default " + listed(kPrintErrorNames));
  app.add_option("--faults", faults, "What goes wrong, NAME=NUMBER,...; by default " + listed(kSeriesFaultNames));
  app.add_option("--placements", series.placements, "Numbers of the plan; by default all seven")->delimiter(',');
  app.add_option("--angles", series.angles, "Table angles per placement")->capture_default_str();
  app.add_option("--hand-held", series.hand_held, "That many pairs of a board held by hand instead of the plan");
  app.add_flag("--exact", series.exact_placements, "Put the board down exactly as planned");
}

Result<SeriesOptions> ShootBoardOptions::chosen() const {
  SeriesOptions options = series;
  int end = 0;
  if (std::sscanf(board.c_str(), "%dx%d%n", &options.board.columns, &options.board.rows, &end) != 2 ||
      end != static_cast<int>(board.size())) {
    return fail(ErrorCode::invalid_input, "--board {}: write COLUMNSxROWS", board);
  }
  auto variation = rig.variation();
  if (!variation) return pass_on(variation);
  options.rig = *variation;
  auto of_rig = profile.chosen();
  if (!of_rig) return pass_on(of_rig);
  options.profile = *of_rig;
  if (const auto set = set_by_name(options.print, kPrintErrorNames, print); !set) return pass_on(set, "--print");
  if (const auto set = set_by_name(options.faults, kSeriesFaultNames, faults); !set) return pass_on(set, "--faults");
  return options;
}

}  // namespace scanrig::sim
