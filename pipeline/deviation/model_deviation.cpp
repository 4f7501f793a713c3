#include "pipeline/deviation/model_deviation.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "core/files.h"
#include "core/hash.h"
#include "pipeline/deviation/deviation.h"
#include "pipeline/deviation/reference_fit.h"
#include "pipeline/deviation/references.h"
#include "pipeline/model_io/bytes.h"
#include "pipeline/model_io/mesh_reader.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kMethod = "deviation 1";  // other values for the same files: another number
constexpr const char* kDeviations = "model/deviation";
constexpr double kUmPerMm = 1000.0;

/// Both files' content and the name of what is made of them.
struct ComparedFiles {
  std::string model_file, model, reference, key;
};

Result<ComparedFiles> read_compared(const DeviationTask& task) {
  ComparedFiles files;
  auto reference = read_reference(task.jobs_root, task.reference);
  if (!reference) return pass_on(reference);
  files.reference = std::move(*reference);
  for (const char* name : {"model/view.glb", "model/model.glb"}) {
    auto model = read_file(task.job_folder / name);
    if (!model && model.error().code == ErrorCode::not_found) continue;
    if (!model) return pass_on(model);
    files.model_file = name;
    files.model = std::move(*model);
    files.key = sha256(sha256(files.model) + sha256(files.reference) + kMethod).substr(0, 16);
    return files;
  }
  return fail(ErrorCode::not_found, "deviation: job {} has no model", task.job_folder.filename().string());
}

std::string kept_as(const DeviationTask& task, const ComparedFiles& files, const char* kind) {
  return fmt::format("{}/{}-{}{}", kDeviations, task.reference, files.key, kind);
}

std::optional<ModelDeviation> kept_deviation(const DeviationTask& task, const ComparedFiles& files) {
  const auto text = read_file(task.job_folder / kept_as(task, files, ".json"));
  if (!text) return std::nullopt;
  try {
    const json kept = json::parse(*text);
    return ModelDeviation{.model_file = files.model_file,
                          .values_file = kept_as(task, files, ".um16"),
                          .vertices = kept.at("vertices"),
                          .confirmed = kept.at("confirmed"),
                          .fits_otherwise = kept.at("fits_otherwise"),
                          .known_share = kept.at("known_share"),
                          .mean_mm = kept.at("mean_mm"),
                          .rms_mm = kept.at("rms_mm"),
                          .p95_mm = kept.at("p95_mm"),
                          .min_mm = kept.at("min_mm"),
                          .max_mm = kept.at("max_mm")};
  } catch (const json::exception&) {
    return std::nullopt;  // damaged: it is made again
  }
}

std::string values_of(const Deviation& deviation) {
  std::string bytes;
  bytes.reserve(2 * deviation.mm.size());
  for (const float mm : deviation.mm) {
    const double um = std::clamp(std::round(kUmPerMm * mm), -32767.0, 32767.0);
    append_bytes(bytes, static_cast<std::int16_t>(std::isfinite(mm) ? um : kUnknownUm));
  }
  return bytes;
}

/// The values first: a description names only what is there. The job's folder may be gone by now.
Result<void> keep(const DeviationTask& task, const ModelDeviation& made, const std::string& values,
                  const std::string& description_file) {
  std::error_code error;
  fs::create_directory(task.job_folder / kDeviations, error);
  if (error) return fail(ErrorCode::io, "deviation: cannot write to {}: {}", task.job_folder.string(), error.message());
  if (auto done = write_file_atomically(task.job_folder / made.values_file, values); !done) return done;
  const nlohmann::ordered_json text{{"reference", task.reference},
                                    {"model_file", made.model_file},
                                    {"vertices", made.vertices},
                                    {"confirmed", made.confirmed},
                                    {"fits_otherwise", made.fits_otherwise},
                                    {"known_share", made.known_share},
                                    {"mean_mm", made.mean_mm},
                                    {"rms_mm", made.rms_mm},
                                    {"p95_mm", made.p95_mm},
                                    {"min_mm", made.min_mm},
                                    {"max_mm", made.max_mm}};
  return write_file_atomically(task.job_folder / description_file, text.dump(2) + "\n");
}

}  // namespace

Result<std::optional<ModelDeviation>> find_deviation(const DeviationTask& task) {
  const auto files = read_compared(task);
  if (!files) return pass_on(files);
  return kept_deviation(task, *files);
}

Result<ModelDeviation> compute_deviation(const DeviationTask& task, const Context& context) {
  const auto files = read_compared(task);
  if (!files) return pass_on(files);
  if (auto kept = kept_deviation(task, *files)) return *kept;
  const auto model = parse_glb(files->model, files->model_file);
  if (!model) return pass_on(model);
  const auto reference = parse_ply(files->reference, task.reference);
  if (!reference) return pass_on(reference);
  const auto fit = fit_to_reference(*model, *reference, {}, context);
  if (!fit) return pass_on(fit);
  const auto found = deviation_from(*reference, *model, fit->reference_from_model, context);
  if (!found) return pass_on(found);
  ModelDeviation made{.model_file = files->model_file,
                      .values_file = kept_as(task, *files, ".um16"),
                      .vertices = found->mm.size(),
                      .confirmed = fit->confirmed,
                      .fits_otherwise = fit->fits_otherwise,
                      .known_share = found->known_share,
                      .mean_mm = found->mean_mm,
                      .rms_mm = found->rms_mm,
                      .p95_mm = found->p95_mm,
                      .min_mm = found->min_mm,
                      .max_mm = found->max_mm};
  if (auto kept = keep(task, made, values_of(*found), kept_as(task, *files, ".json")); !kept) return pass_on(kept);
  return made;
}

}  // namespace scanrig
