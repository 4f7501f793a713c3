#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// A mesh that models are compared with, as it is kept.
struct Reference {
  std::string name;
  std::uintmax_t bytes = 0;
};

inline constexpr std::size_t kMaxReferenceFaces = 2'000'000;

/// Where the references of a folder of all jobs are; no job's id begins with a dot.
std::filesystem::path references_folder(const std::filesystem::path& jobs_root);

/// Letters, digits, "-", "_" and "." (not first), at most 64: also the name of a file.
bool may_name_reference(std::string_view name);

/// A foreign mesh made ready: vertices joined, a closed surface's faces outwards. Fails with `invalid_input`.
Result<Mesh> prepared_reference(const Mesh& mesh);

/// Reads an STL, PLY, OBJ (mm) or GLB (m) file and keeps it, in the place of one of the same name. Fails with
/// `not_found`, `io`, `invalid_input`.
Result<void> add_reference(const std::filesystem::path& jobs_root, const std::string& name,
                           const std::filesystem::path& file);
/// Fails with `not_found`, `io`.
Result<void> remove_reference(const std::filesystem::path& jobs_root, const std::string& name);
/// By name; none where the folder is missing. Fails with `io`.
Result<std::vector<Reference>> list_references(const std::filesystem::path& jobs_root);
/// The file's bytes, a PLY file. Fails with `not_found` (also for what is no name), `io`.
Result<std::string> read_reference(const std::filesystem::path& jobs_root, const std::string& name);

}  // namespace scanrig
