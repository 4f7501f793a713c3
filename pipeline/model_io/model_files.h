#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "pipeline/mesh/mesh.h"

namespace scanrig {

/// Files written by write_model_files, relative to the folder.
struct ModelFiles {
  std::vector<std::string> names;
};

/// Writes model.glb, view.glb, model.ply, model.stl, and, with a texture, model.obj, model.mtl, model.png; and
/// `report_json` as report.json unless empty. `model` is in mm, +Y up. All or nothing: everything is written and synced
/// under a temporary name beside `folder`, which then takes its place; an older folder is replaced as a whole. Fails
/// with `degenerate` (no faces), `io`.
Result<ModelFiles> write_model_files(const TexturedMesh& model, std::string_view report_json,
                                     const std::filesystem::path& folder);

/// glTF 2.0 binary: metres, +Y up, vertices doubled where charts meet, texture as JPEG inside, matte material.
/// Fails with `degenerate`, `internal` (the image cannot be encoded).
Result<std::string> encode_glb(const TexturedMesh& model);

struct ViewModelOptions {
  std::size_t max_faces = 130'000;
  int texture_px = 2048;  ///< longest side
  /// Turns the model into another rest; `other_rest` in the node's extras, as x, y, z, w.
  std::optional<Eigen::Quaterniond> other_rest{};
};
/// The model for a browser: fewer faces (meshoptimizer's), a smaller texture or the vertices' colours,
/// KHR_mesh_quantization; at most some 4 MB. Per vertex `_VIEWS`, and `_SIGMA` in units of 0.01 um, 65535 where it is
/// not measured. Fails as encode_glb().
Result<std::string> encode_view_glb(const TexturedMesh& model, const ViewModelOptions& options = {});

/// Binary little-endian, mm, the closed surface: x y z nx ny nz, and if present red green blue, views, sigma.
std::string encode_ply(const Mesh& mesh);

/// Binary; mm, stated in the header.
std::string encode_stl(const Mesh& mesh);

/// Wavefront text, mm; `material_file` is the name of the output of encode_mtl, `image_file` that of the atlas.
std::string encode_obj(const TexturedMesh& model, std::string_view material_file);
std::string encode_mtl(std::string_view image_file);

}  // namespace scanrig
