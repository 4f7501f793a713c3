#include "pipeline/deviation/references.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <system_error>
#include <utility>

#include "core/files.h"
#include "pipeline/mesh/topology.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/model_io/model_files.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReferences = ".references";
constexpr const char* kKept = ".ply";
constexpr std::size_t kMaxReferenceName = 64;

fs::path reference_file(const fs::path& jobs_root, const std::string& name) {
  return references_folder(jobs_root) / (name + kKept);
}

Error no_such_reference(const std::string& name) {
  return {ErrorCode::not_found, fmt::format("reference: there is no {}; scanrig reference list names those there are",
                                            name.substr(0, kMaxReferenceName))};
}

double signed_volume(const Mesh& mesh) {
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.faces) {
    sum += mesh.vertices[a].cast<double>().dot(mesh.vertices[b].cast<double>().cross(mesh.vertices[c].cast<double>()));
  }
  return sum / 6.0;
}

}  // namespace

fs::path references_folder(const fs::path& jobs_root) { return jobs_root / kReferences; }

bool may_name_reference(std::string_view name) {
  const auto is_good = [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.');
  };
  return !name.empty() && name.size() <= kMaxReferenceName && name.front() != '.' && std::ranges::all_of(name, is_good);
}

Result<Mesh> prepared_reference(const Mesh& mesh) {
  if (mesh.faces.size() > kMaxReferenceFaces) {
    return fail(ErrorCode::invalid_input, "reference: {} triangles are too many; reduce it to {}", mesh.faces.size(),
                kMaxReferenceFaces);
  }
  Mesh joined = joined_vertices(mesh);
  if (joined.faces.empty())
    return fail(ErrorCode::invalid_input, "reference: it has no area; name a mesh of a surface");
  if (topology(joined).boundary_edges == 0 && signed_volume(joined) < 0.0) {
    for (auto& face : joined.faces) std::swap(face[1], face[2]);
  }
  return joined;
}

Result<void> add_reference(const fs::path& jobs_root, const std::string& name, const fs::path& file) {
  if (!may_name_reference(name)) {
    return fail(ErrorCode::invalid_input,
                "reference: {} is no name; use letters, digits, -, _ and ., 64 at most, no . first", name);
  }
  const auto read = read_mesh(file);
  if (!read) return pass_on(read);
  const auto prepared = prepared_reference(*read);
  if (!prepared) return pass_on(prepared);
  if (auto made = create_directories_synced(references_folder(jobs_root)); !made) return made;
  return write_file_atomically(reference_file(jobs_root, name), encode_ply(*prepared));
}

Result<void> remove_reference(const fs::path& jobs_root, const std::string& name) {
  std::error_code ignored;
  if (!may_name_reference(name) || !fs::exists(reference_file(jobs_root, name), ignored)) {
    return tl::unexpected(no_such_reference(name));
  }
  return remove_file_synced(reference_file(jobs_root, name));
}

Result<std::vector<Reference>> list_references(const fs::path& jobs_root) {
  std::vector<Reference> all;
  const auto folder = references_folder(jobs_root);
  std::error_code error;
  for (fs::directory_iterator next(folder, error), end; !error && next != end; next.increment(error)) {
    std::error_code ignored;
    const auto& path = next->path();
    if (path.extension() != kKept || !may_name_reference(path.stem().string())) continue;
    all.push_back({path.stem().string(), next->file_size(ignored)});
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    return fail(ErrorCode::io, "reference: cannot list {}: {}; check its permissions", folder.string(),
                error.message());
  }
  std::ranges::sort(all, {}, &Reference::name);
  return all;
}

Result<std::string> read_reference(const fs::path& jobs_root, const std::string& name) {
  if (!may_name_reference(name)) return tl::unexpected(no_such_reference(name));
  auto bytes = read_file(reference_file(jobs_root, name));
  if (!bytes && bytes.error().code == ErrorCode::not_found) return tl::unexpected(no_such_reference(name));
  return bytes;
}

}  // namespace scanrig
