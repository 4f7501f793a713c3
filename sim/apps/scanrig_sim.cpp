#include <CLI/CLI.hpp>
#include <cstdio>

#include "sim/apps/shoot.h"

int main(int argc, char** argv) {
  using namespace scanrig;
  CLI::App app("The simulated scanning rig");
  app.require_subcommand(1);
  sim::ShootOptions options;
  std::string folder;
  auto* shoot = app.add_subcommand("shoot", "Render a whole scan, with its truth, into a folder");
  shoot->add_option("--out", folder, "The scan folder to make")->required();
  shoot->add_option("--object", options.scene.object, "OBJ, PLY or GLB file; the built-in figurine if not given");
  shoot->add_option("--height-mm", options.scene.height_mm, "Largest extent of the object")->capture_default_str();
  shoot->add_option("--seed", options.scene.seed, "Placements, noise and table errors")->capture_default_str();
  shoot->add_option("--poses", options.scene.poses, "How often the object is put down")->capture_default_str();
  shoot->add_option("--views", options.views, "Table angles a pose")->check(CLI::Range(1, 99))->capture_default_str();
  shoot->add_option("--scale", options.scene.image_scale, "Resolution, as a share of 1280x960")->capture_default_str();
  shoot->add_flag("--same-rest", options.scene.same_rest_twice, "The operator forgets to turn the object over");
  shoot->add_flag("--any-size", options.scene.any_size, "Put the object down although it is too large");
  shoot->add_flag("!--no-noise", options.scene.noise, "Leave the sensors' noise out");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::usage);
  }
  if (const auto done = sim::shoot(options, folder); !done) {
    std::fprintf(stderr, "scanrig-sim: %s\n", done.error().message.c_str());
    return static_cast<int>(exit_code(done.error().code));
  }
  return 0;
}
