#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "core/context.h"
#include "core/result.h"

namespace scanrig {

/// How a job's model deviates from a reference; kept in the job's folder.
struct ModelDeviation {
  std::string model_file;   ///< within the job's folder: the GLB whose vertices are compared
  std::string values_file;  ///< within the job's folder: 16 bit, little-endian, signed um; kUnknownUm: not known
  std::size_t vertices = 0;
  double confirmed = 0.0;       ///< share of the measured surface that lies at the reference
  bool fits_otherwise = false;  ///< another motion fits as well: a symmetric part
  double known_share = 0.0, mean_mm = 0.0, rms_mm = 0.0, p95_mm = 0.0, min_mm = 0.0, max_mm = 0.0;
};

inline constexpr int kUnknownUm = -32768;  ///< values beyond +-32767 um are these

/// A model and the reference that it is compared with.
struct DeviationTask {
  std::filesystem::path job_folder;  ///< has model/view.glb or model/model.glb
  std::filesystem::path jobs_root;   ///< has the references
  std::string reference;
};

/// What was compared before: same model, same reference. Nothing: it is to be computed. Fails with `not_found` (no
/// model, no reference), `io`.
Result<std::optional<ModelDeviation>> find_deviation(const DeviationTask& task);

/// Aligns, compares, and writes model/deviation/NAME-KEY.json and .um16, which never change; KEY is of both files'
/// content. Seconds. Fails as fit_to_reference(), deviation_from(), find_deviation().
Result<ModelDeviation> compute_deviation(const DeviationTask& task, const Context& context = {});

}  // namespace scanrig
