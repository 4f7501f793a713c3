#include "pipeline/model_io/model_files.h"

#include <unistd.h>

#include <system_error>

#include "core/files.h"
#include "core/image_codec.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

Result<ModelFiles> write_into(const fs::path& folder, const TexturedMesh& model, std::string_view report_json) {
  ModelFiles files;
  Result<void> written;
  const auto write = [&](const char* name, std::string_view bytes) {
    if (!written) return;
    files.names.emplace_back(name);
    written = write_file_atomically(folder / name, bytes);
  };
  const auto glb = encode_glb(model);
  if (!glb) return pass_on(glb);
  write("model.glb", *glb);
  const auto view = encode_view_glb(model);
  if (!view) return pass_on(view);
  write("view.glb", *view);
  write("model.ply", encode_ply(model.mesh));
  write("model.stl", encode_stl(model.mesh));
  if (!model.atlas.empty()) {
    const auto png = encode_png(model.atlas);
    if (!png) return pass_on(png);
    write("model.png", as_text(*png));
    write("model.mtl", encode_mtl("model.png"));
    write("model.obj", encode_obj(model, "model.mtl"));
  }
  if (!report_json.empty()) write("report.json", report_json);
  if (!written) return pass_on(written);
  return files;
}

}  // namespace

Result<ModelFiles> write_model_files(const TexturedMesh& model, std::string_view report_json, const fs::path& folder) {
  if (model.mesh.faces.empty()) return fail(ErrorCode::degenerate, "write model: the model has no faces");
  std::error_code error;
  const fs::path target = fs::absolute(folder, error).lexically_normal();
  const fs::path prepared = target.parent_path() / fmt::format(".{}.tmp{}", target.filename().string(), ::getpid());
  fs::remove_all(prepared, error);
  if (auto made = create_directories_synced(prepared); !made) return pass_on(made, "write model");
  auto files = write_into(prepared, model, report_json);
  Result<void> placed;
  if (files) placed = replace_folder(prepared, target);
  if (!files || !placed) {
    fs::remove_all(prepared, error);
    return files ? pass_on(placed, "write model") : pass_on(files, "write model");
  }
  return files;
}

}  // namespace scanrig
