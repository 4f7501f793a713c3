// Verbs that read and write files only.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <memory>
#include <sstream>

#include "daemon/ctl/commands.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig::ctl {

namespace {

void add_reconstruct(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<ReconstructVerb>();
  auto* sub = app.add_subcommand("reconstruct", "make the model of a scan folder");
  sub->add_option("DIR", verb->scan, "the scan folder")->required();
  sub->add_option("--out", verb->out, "new folder for the model (default: DIR/model)");
  sub->add_option("--threads", verb->options.threads, "threads; 0: all of the machine's")->check(CLI::Range(0, 1024));
  sub->add_option("--voxel-mm", verb->options.voxel_mm,
                  "size of a voxel (default: 0.25, or what suits imported range images)")
      ->check(CLI::Range(kMinVoxelMm, kMaxVoxelMm));
  sub->add_option_function<double>(
         "--memory-gib",
         [verb](double gib) { verb->options.memory_bytes = static_cast<std::uintmax_t>(gib * (1U << 30)); },
         "keep within this much memory; the model is the same (default: no limit)")
      ->check(CLI::Range(0.25, 1024.0));
  sub->add_option("--fusion", verb->options.fusion, "how poses are integrated")
      ->check(CLI::IsMember({"evidence", "paper"}));
  sub->add_option("--rests", verb->options.rests, "how rests are found")->check(CLI::IsMember({"hull", "egi"}));
  sub->add_flag("--fixture", verb->options.fixture,
                "the part stood on putty, pins or a magnet: find poses without contact, leave the fixture out");
  sub->add_flag("!--no-texture", verb->options.texture, "shape only");
  sub->add_option("--watch", verb->options.watch,
                  "what to do when the rig has moved since its calibration: refine (or refuse), report, off")
      ->check(CLI::IsMember({"refine", "report", "off"}));
  auto* json = sub->add_flag("--json", verb->json, "print JSON");
  sub->add_flag("--lines", verb->lines, "tell the progress in lines for a program")->excludes(json);
  sub->callback([&chosen, verb] { chosen = [verb] { return reconstruct(*verb); }; });
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Why `scanrig reconstruct` would not take these words; empty: it would.
std::string problem_of_reconstruct(const std::string& text) {
  auto words = words_of(text);
  for (const char* own : {"--out", "--lines", "--json", "--threads", "--memory-gib"}) {
    const auto is_own = [own](const std::string& word) {
      return word == own || word.starts_with(std::string(own) + "=");
    };
    if (std::ranges::any_of(words, is_own)) return std::string(own) + " is set by farm itself";
  }
  CLI::App app;
  Chosen ignored;
  add_reconstruct(app, ignored);
  words.insert(words.begin(), {"reconstruct", "DIR"});
  std::ranges::reverse(words);  // as CLI11 takes them
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

void add_farm(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<FarmVerb>();
  auto& options = verb->options;
  auto* sub = app.add_subcommand("farm", "many scan folders on a Slurm cluster");
  sub->require_subcommand(1);
  auto* again = sub->add_subcommand("reprocess", "make the models of scan folders that are missing or made otherwise");
  again->add_option("FOLDERS", options.scans, "scan folders that the nodes see under the same path")->required();
  const CLI::Validator check(problem_of_reconstruct, "");
  again
      ->add_option_function<std::string>(
          "--with", [verb](const std::string& text) { verb->options.with = words_of(text); },
          "options of scanrig reconstruct, such as \"--voxel-mm 0.5\"")
      ->check(check);
  again->add_option("--out", options.out, "models are DIR/NAME (default: the model of each scan is replaced)");
  again->add_option("--partition", options.partition, "of the cluster (default: its own)");
  again->add_option_function<std::string>(
      "--sbatch", [verb](const std::string& text) { verb->options.sbatch = words_of(text); },
      "further options of sbatch, such as \"--qos=low --time=60\"");
  again->add_option("--program", options.program, "scanrig on the nodes")->capture_default_str();
  again->add_option("--commands", options.commands, "folder of sbatch and squeue (default: PATH)");
  again->add_option("--cores", options.cores, "of a scan")->capture_default_str()->check(CLI::Range(1, 1024));
  again->add_option("--memory-gib", options.memory_gib, "of a scan")->capture_default_str()->check(CLI::Range(1, 1024));
  again->add_flag("--json", verb->json, "print JSON, a line per scan");
  again->callback([&chosen, verb] { chosen = [verb] { return farm_reprocess(*verb); }; });
}

void add_board(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<BoardVerb>();
  const auto ignored = std::make_shared<bool>();
  auto* sub = app.add_subcommand("board", "print a calibration board as PDF, to scale");
  sub->add_option("--out", verb->out, "the PDF to write")->required();
  add_board_options(*sub, verb->board, *ignored);
  sub->add_option("--page-mm", verb->page_mm, "width and height of the page (default: A4 landscape)")->expected(2);
  sub->callback([&chosen, verb, ignored] { chosen = [verb] { return board(*verb); }; });
}

void add_range(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<RangeVerb>();
  auto* sub = app.add_subcommand("range", "measure one stereo pair of anybody's cameras: disparity, depth, sigma");
  sub->add_option("LEFT", verb->left, "the left image: PNG or TIFF, 8 to 16 bits")->required();
  sub->add_option("RIGHT", verb->right, "the right image")->required();
  sub->add_option("--out", verb->out, "new folder for disparity.tiff, depth.tiff, sigma.tiff and colours.png")
      ->required();
  auto* calibration = sub->add_option("--calibration", verb->calibration, "calibration.json, or a folder that has one");
  sub->add_flag("--rectified", verb->rectified, "the rows of both images correspond already")->excludes(calibration);
  sub->add_option("--focal", verb->focal_px, "focal length of a rectified pair, pixels")->excludes(calibration);
  sub->add_option("--baseline", verb->baseline_mm, "distance of its cameras, mm")->excludes(calibration);
  sub->add_option("--centre", verb->centre, "its principal point, pixels (default: the image's middle)")
      ->expected(2)
      ->excludes(calibration);
  sub->add_option("--disparities", verb->disparities,
                  "lowest and highest, pixels (default: of the working volume; rectified: 0 to a quarter of the width)")
      ->expected(2);
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return range(*verb); }; });
}

void add_evaluate(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<EvaluateVerb>();
  auto* sub = app.add_subcommand("evaluate", "compare a model with the truth of a simulated scan");
  sub->add_option("DIR", verb->scan, "the scan folder, with truth.json")->required();
  sub->add_option("--model", verb->model, "the model's folder (default: DIR/model)");
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return evaluate(*verb); }; });
}

void add_acceptance(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<AcceptanceVerb>();
  auto* sub = app.add_subcommand("acceptance", "measure a calibrated artefact in models of it: VDI/VDE 2634");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = add_action(*sub, chosen, name, description, verb, &measure_artefact);
    action->add_option("MODEL", verb->models, "mesh, folder of a model or scan, or job; several: repeated measurements")
        ->required();
    action->add_option("--limit", verb->limits, "NAME=MM: form, size, spacing, flatness or step; beyond it ends with 8")
        ->allow_extra_args(false);
    action->add_option("--report", verb->report, "new page to write, as .html");
    action->add_option("--jobs", verb->jobs, "folder of all jobs (default: the one that the configuration names)");
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    action->add_flag("--json", verb->json, "print JSON");
    return action;
  };
  auto* sphere = add("sphere", "one ball: probing error, form and size");
  auto* bar = add("ball-bar", "two balls: sphere spacing error, and each ball");
  auto* flat = add("plane", "the largest flat face: flatness measurement error");
  auto* steps = add("step-gauge", "parallel faces: errors of their heights");
  for (auto* action : {sphere, bar}) {
    action->add_option("--diameter", verb->diameter_mm, "of a ball, mm, as calibrated")->required();
  }
  bar->add_option("--length", verb->length_mm, "between the balls' centres, mm, as calibrated")->required();
  steps->add_option("--heights", verb->heights_mm, "of the steps over the lowest one, mm, as calibrated: 20,30,35")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  for (auto* action : {sphere, bar, flat, steps}) {
    action->add_option("--uncertainty", verb->uncertainty_mm,
                       "of the calibration, mm, k = 2, as the certificate states it");
  }
}

void add_import_meshes(CLI::App& import, Chosen& chosen) {
  const auto verb = std::make_shared<ImportMeshesVerb>();
  auto* sub = import.add_subcommand("meshes", "partial scans in unknown positions: finds how they fit together");
  sub->alias("ply");
  sub->add_option("SCANS", verb->scans, "one file per scan: PLY range grid, or mesh (PLY, OBJ, STL, GLB)")->required();
  sub->add_option("--out", verb->out, "the scan folder to make")->required();
  sub->add_option("--unit", verb->unit, "of the files' lengths (default: m for range grids, mm for meshes)")
      ->check(CLI::IsMember({"mm", "cm", "m", "in"}));
  sub->add_option("--threads", verb->threads, "threads; 0: all of the machine's")->check(CLI::Range(0, 1024));
  sub->add_flag("--json", verb->json, "print JSON");
  sub->callback([&chosen, verb] { chosen = [verb] { return import_meshes(*verb); }; });
}

void add_import(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<ImportVerb>();
  auto* sub = app.add_subcommand("import", "make a scan folder from other people's data");
  sub->require_subcommand(1);
  auto* stanford = sub->add_subcommand("stanford", "range scans of the Stanford repository");
  stanford->add_option("--pose", verb->conf, "the .conf file of a pose; once or twice")
      ->required()
      ->expected(1)
      ->take_all();
  stanford->add_option("--out", verb->out, "the scan folder to make")->required();
  stanford->add_flag("--json", verb->json, "print JSON");
  stanford->callback([&chosen, verb] { chosen = [verb] { return import_stanford(*verb); }; });
  add_import_meshes(*sub, chosen);
}

void add_convert(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<ConvertVerb>();
  auto* sub = app.add_subcommand("convert", "write a calibration, or the views of a scan, for other programs");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description, const char* from, const char* out) {
    auto* action = add_action(*sub, chosen, name, description, verb, &convert);
    action->add_option("FROM", verb->from, from)->required();
    action->add_option("--out", verb->out, out)->required();
    action->add_flag("--json", verb->json, "print JSON");
    return action;
  };
  constexpr const char* kCalibration = "calibration.json, or a folder that has one";
  add("mrcal", "left.cameramodel and right.cameramodel", kCalibration, "the folder to make");
  add("opencv", "a YAML file for cv::FileStorage", kCalibration, "the file to write");
  add("colmap", "cameras and images as a text model, one per pose", "a scan folder", "the folder to make")
      ->add_flag("--images", verb->images, "copy the plain images, too, ready for use: demosaiced");
}

void add_check_config(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<CheckConfigVerb>();
  auto* sub = app.add_subcommand("check-config", "read a rig.toml and tell everything that is wrong with it");
  sub->add_option("FILE", verb->file, "the configuration")->capture_default_str();
  sub->add_flag("--json", verb->json, "print JSON");
  sub->add_option("--drives", verb->drives, "folder of the drive profiles");
  sub->callback([&chosen, verb] { chosen = [verb] { return check_config(*verb); }; });
}

void add_token(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<TokenVerb>();
  auto* sub = app.add_subcommand("token", "who may use the API over TCP");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = add_action(*sub, chosen, name, description, verb, &token);
    action->add_option("--file", verb->file, "the file of tokens (default: the one that the configuration names)");
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    action->add_flag("--json", verb->json, "print JSON");
    return action;
  };
  auto* make = add("add", "make a token and print it, once");
  make->add_option("NAME", verb->name, "of who or what gets it")->required();
  make->add_option("--role", verb->role, "what it may do")
      ->check(CLI::IsMember({"viewer", "operator", "engineer"}))
      ->capture_default_str();
  add("list", "names, roles and dates; never the tokens");
  add("revoke", "make a token void; the service refuses it within a second")
      ->add_option("NAME", verb->name, "of the token")
      ->required();
}

void add_reference(CLI::App& app, Chosen& chosen) {
  const auto verb = std::make_shared<ReferenceVerb>();
  auto* sub = app.add_subcommand("reference", "meshes, such as a design's, that models are compared with");
  sub->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    auto* action = add_action(*sub, chosen, name, description, verb, &reference);
    action->add_option("--jobs", verb->jobs, "folder of all jobs (default: the one that the configuration names)");
    action->add_option("--config", verb->config, "the rig's configuration")->capture_default_str();
    action->add_flag("--json", verb->json, "print JSON");
    return action;
  };
  auto* make = add("add", "keep a mesh; one of the same name is replaced");
  make->add_option("FILE", verb->file, "STL, PLY or OBJ in mm, or GLB")->required();
  make->add_option("--name", verb->name, "its name on the page (default: the name of the file)");
  add("list", "names and sizes");
  add("remove", "delete a mesh; what was compared with it stays")
      ->add_option("NAME", verb->name, "of the mesh")
      ->required();
}

}  // namespace

void add_offline_commands(CLI::App& app, Chosen& chosen) {
  add_reconstruct(app, chosen);
  add_farm(app, chosen);
  add_range(app, chosen);
  add_evaluate(app, chosen);
  add_acceptance(app, chosen);
  add_import(app, chosen);
  add_convert(app, chosen);
  add_board(app, chosen);
  add_check_config(app, chosen);
  add_reference(app, chosen);
  add_token(app, chosen);
}

}  // namespace scanrig::ctl
