#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "config/rig_config.h"
#include "core/catch_exceptions.h"
#include "core/parallel.h"
#include "core/signal_stop.h"
#include "core/timestamp.h"
#include "daemon/api/access.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/deviation/references.h"
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/evaluate/frame_height.h"
#include "pipeline/importers/import_meshes.h"
#include "pipeline/importers/import_stanford.h"

namespace scanrig::ctl {
namespace {

Result<void> make_model(const ScanFolder& scan, const ReconstructVerb& verb, const Context& context,
                        const std::filesystem::path& out) {
  const auto model = scanrig::reconstruct(scan, verb.options, context);
  if (!model) return pass_on(model);
  for (const auto& pose : model->report->at("poses")) {
    if (!pose["watch"].is_object() || verb.lines) continue;
    for (const auto& sentence : pose["watch"]["sentences"]) fmt::print(stderr, "{}\n", sentence.get<std::string>());
  }
  for (const auto& disagreement : model->report->at("disagreements")) {
    if (!verb.lines) fmt::print(stderr, "{}\n", disagreement["sentence"].get<std::string>());
  }
  return write_model(*model, out, verb.options.threads);
}

}  // namespace

ExitCode reconstruct(const ReconstructVerb& verb) {
  const auto out = verb.out.empty() ? verb.scan / "model" : verb.out;
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return report_error({ErrorCode::exists, out.string() + ": already there; name another folder with --out"});
  }
  const auto scan = ScanFolder::open(verb.scan);
  if (!scan) return report_error(scan.error());

  const SignalStop stop;
  std::FILE* told = verb.json ? stderr : stdout;  // bars beside the JSON, not in it
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  const auto progress = [&](std::string_view stage, double fraction) {
    if (!verb.lines) return bars.update(std::string(stage), fraction);
    fmt::print("{}\t{:.3f}\n", stage, fraction);
    std::fflush(stdout);
  };
  const auto made = catch_exceptions("the reconstruction", [&] {
    return make_model(*scan, verb, {stop.token(), progress}, out);
  });
  if (!verb.lines) bars.end(made.has_value());
  if (!made) {
    if (verb.lines) fmt::print("failed\t{}\t{}\n", to_string(made.error().code), made.error().message);
    return report_error(made.error());
  }
  const auto glb = out / "model.glb", report = out / "report.json";
  if (verb.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"model", glb}, {"report", report}}.dump());
  } else {
    fmt::print("{}\n{}\n", glb.string(), report.string());
  }
  return ExitCode::ok;
}

ExitCode evaluate(const EvaluateVerb& verb) {
  const auto truth = read_truth(verb.scan);
  if (!truth) return report_error(truth.error());
  auto claim = read_claim(verb.model.empty() ? verb.scan / "model" : verb.model);
  if (!claim) return report_error(claim.error());
  const auto photos = ScanFolder::open(verb.scan);
  if (!photos) return report_error(photos.error());

  const auto calibration = photos->load_calibration();
  if (!calibration) return report_error(calibration.error());

  const SignalStop stop;
  const double height = frame_height(*calibration, *truth);
  auto scores = scanrig::evaluate(raised(std::move(*claim), height), *truth, &*photos, {}, {stop.token(), {}});
  if (!scores) return report_error(scores.error());
  scores->frame_height_mm = height;
  const auto limits = gates(*scores);
  if (verb.json) {
    fmt::print("{}\n", to_json(*scores).dump(2));
  } else {
    fmt::print("{}", to_table(*scores));
  }
  const auto missed = std::ranges::count_if(limits, [](const Gate& gate) { return !gate.ok(); });
  if (missed == 0) return ExitCode::ok;
  return report_error(ExitCode::below_limits,
                      fmt::format("{}: {} of {} limits are not reached", verb.scan.string(), missed, limits.size()));
}

ExitCode import_stanford(const ImportVerb& verb) {
  const auto pose2 = verb.conf.size() > 1 ? std::optional(verb.conf[1]) : std::nullopt;
  const auto imported = scanrig::import_stanford(verb.conf[0], pose2, verb.out);
  if (!imported) return report_error(imported.error());
  if (verb.json) {
    fmt::print("{}\n", nlohmann::json{{"scan", verb.out}}.dump());
  } else {
    fmt::print("{}\n", verb.out.string());
  }
  return ExitCode::ok;
}

namespace {

double mm_of(const std::string& unit) {
  return unit == "mm" ? 1.0 : unit == "cm" ? 10.0 : unit == "m" ? 1000.0 : unit == "in" ? 25.4 : 0.0;
}

void print_import(const ImportMeshesVerb& verb, const MeshImport& import) {
  if (!verb.json) {
    fmt::print("{}\n{} of {} scans joined, {:.3f} mm apart (median)\n", verb.out.string(), import.used.size(),
               import.used.size() + import.left_out.size(), import.median_mm);
    for (const auto& out : import.left_out) fmt::print("{}\n", out.sentence);
    return;
  }
  auto used = nlohmann::ordered_json::array(), left_out = used;
  for (const auto& one : import.used) used.push_back({{"view", one.view}, {"file", one.file}});
  for (const auto& one : import.left_out) left_out.push_back({{"file", one.file}, {"sentence", one.sentence}});
  fmt::print("{}\n",
             nlohmann::ordered_json{
                 {"scan", verb.out}, {"views", used}, {"left_out", left_out}, {"median_mm", import.median_mm}}
                 .dump());
}

}  // namespace

ExitCode import_meshes(const ImportMeshesVerb& verb) {
  const SignalStop stop;
  StageBars bars(stderr, ::isatty(::fileno(stderr)) == 1);
  const auto progress = [&](std::string_view stage, double fraction) { bars.update(std::string(stage), fraction); };
  const auto import = catch_exceptions("the import", [&] {
    Result<MeshImport> done;
    with_threads(verb.threads, [&] {
      done = scanrig::import_meshes(verb.scans, verb.out, {.unit_mm = mm_of(verb.unit)}, {stop.token(), progress});
    });
    return done;
  });
  bars.end(import.has_value());
  if (!import) return report_error(import.error());
  print_import(verb, *import);
  return ExitCode::ok;
}

ExitCode check_config(const CheckConfigVerb& verb) {
  const auto config = config::read_rig_config(verb.file, verb.drives);
  if (verb.json) {
    auto problems = nlohmann::ordered_json::array();
    std::istringstream lines(config ? std::string() : config.error().message);
    for (std::string line; std::getline(lines, line);) problems.push_back(line);
    const auto warnings = config ? config->warnings : std::vector<std::string>();
    fmt::print("{}\n",
               nlohmann::ordered_json{
                   {"file", verb.file}, {"ok", config.has_value()}, {"problems", problems}, {"warnings", warnings}}
                   .dump(2));
  }
  if (!config && verb.json) {
    return report_error(exit_code(config.error().code), verb.file.string() + " cannot be used: see its problems");
  }
  if (!config) return report_error(config.error());
  if (!verb.json) {
    for (const auto& warning : config->warnings) fmt::print(stderr, "{}\n", warning);
    fmt::print("{}: no problems\n", verb.file.string());
  }
  return ExitCode::ok;
}

namespace {

using nlohmann::ordered_json;

Result<std::filesystem::path> file_of(const TokenVerb& verb) {
  if (!verb.file.empty()) return verb.file;
  const auto config = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
  if (!config) return pass_on(config);
  if (config->api.tokens.empty()) {
    return fail(ErrorCode::invalid_input, "{}: [api] names no file of tokens: add `tokens`, or say --file",
                verb.config.string());
  }
  return config->api.tokens;
}

Result<void> add(const TokenVerb& verb, TokenFile tokens, const std::filesystem::path& file) {
  const auto token =
      tokens.add(verb.name, parse_role(verb.role).value_or(Role::viewer), iso_time(std::chrono::system_clock::now()));
  if (!token) return pass_on(token);
  if (auto written = tokens.write(file); !written) return written;
  if (verb.json) {
    fmt::print("{}\n", ordered_json{{"name", verb.name}, {"role", verb.role}, {"token", *token}}.dump());
  } else {
    fmt::print("{}\n", *token);
  }
  return {};
}

Result<void> revoke(const TokenVerb& verb, TokenFile tokens, const std::filesystem::path& file) {
  if (auto revoked = tokens.revoke(verb.name); !revoked) return revoked;
  if (auto written = tokens.write(file); !written) return written;
  if (verb.json) fmt::print("{}\n", ordered_json{{"revoked", verb.name}}.dump());
  return {};
}

void list(const TokenVerb& verb, const TokenFile& tokens) {
  auto all = ordered_json::array();
  for (const auto& token : tokens.records()) {
    if (!verb.json) fmt::print("{:<32}  {:<8}  {}\n", token.name, to_string(token.role), token.created);
    all.push_back({{"name", token.name}, {"role", to_string(token.role)}, {"created", token.created}});
  }
  if (verb.json) fmt::print("{}\n", ordered_json{{"tokens", all}}.dump(2));
}

}  // namespace

ExitCode token(const TokenVerb& verb) {
  const auto file = file_of(verb);
  if (!file) return report_error(file.error());
  auto tokens = TokenFile::read(*file);
  if (!tokens) return report_error(tokens.error());
  Result<void> done;
  if (verb.what == "add") {
    done = add(verb, std::move(*tokens), *file);
  } else if (verb.what == "revoke") {
    done = revoke(verb, std::move(*tokens), *file);
  } else {
    list(verb, *tokens);
  }
  return done ? ExitCode::ok : report_error(done.error());
}

namespace {

Result<std::filesystem::path> jobs_folder_of(const ReferenceVerb& verb) {
  if (!verb.jobs.empty()) return verb.jobs;
  const auto config = config::read_rig_config(verb.config, {}, config::Cameras::or_simulated);
  if (!config) return pass_on(config);
  return config->storage.root;
}

Result<void> print_references(const std::filesystem::path& jobs, bool json) {
  const auto found = list_references(jobs);
  if (!found) return pass_on(found);
  auto all = ordered_json::array();
  for (const auto& one : *found) {
    if (!json) fmt::print("{:<40}  {:>10} bytes\n", one.name, one.bytes);
    all.push_back({{"name", one.name}, {"bytes", one.bytes}});
  }
  if (json) fmt::print("{}\n", ordered_json{{"references", all}}.dump(2));
  return {};
}

}  // namespace

ExitCode reference(const ReferenceVerb& verb) {
  const auto jobs = jobs_folder_of(verb);
  if (!jobs) return report_error(jobs.error());
  const auto name = verb.name.empty() ? verb.file.stem().string() : verb.name;
  Result<void> done;
  if (verb.what == "add") {
    done = add_reference(*jobs, name, verb.file);
    if (done && verb.json) fmt::print("{}\n", ordered_json{{"name", name}}.dump());
    if (done && !verb.json) fmt::print("{}\n", name);
  } else if (verb.what == "remove") {
    done = remove_reference(*jobs, name);
    if (done && verb.json) fmt::print("{}\n", ordered_json{{"removed", name}}.dump());
  } else {
    done = print_references(*jobs, verb.json);
  }
  return done ? ExitCode::ok : report_error(done.error());
}

}  // namespace scanrig::ctl
