#include "pipeline/model_io/model_files.h"

#include <unistd.h>

#include <functional>
#include <system_error>

#include "core/files.h"
#include "core/image_codec.h"
#include "core/parallel.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

struct Encoding {
  const char* name;
  std::function<Result<std::string>()> encode;
};

/// The longest ones first: they are encoded side by side.
std::vector<Encoding> encodings_of(const TexturedMesh& model) {
  std::vector<Encoding> all;
  if (!model.atlas.empty()) {
    all.push_back({"model.png", [&]() -> Result<std::string> {
                     const auto png = encode_png(model.atlas);
                     if (!png) return pass_on(png);
                     return std::string(as_text(*png));
                   }});
    all.push_back({"model.obj", [&] { return encode_obj(model, "model.mtl"); }});
    all.push_back({"model.mtl", [] { return encode_mtl("model.png"); }});
  }
  all.push_back({"view.glb", [&] { return encode_view_glb(model); }});
  all.push_back({"model.glb", [&] { return encode_glb(model); }});
  all.push_back({"model.ply", [&] { return encode_ply(model.mesh); }});
  all.push_back({"model.stl", [&] { return encode_stl(model.mesh); }});
  return all;
}

Result<ModelFiles> write_into(const fs::path& folder, const TexturedMesh& model, std::string_view report_json) {
  const std::vector<Encoding> encodings = encodings_of(model);
  std::vector<Result<void>> written(encodings.size());
  parallel_for(encodings.size(), [&](std::size_t i) {
    const auto bytes = encodings[i].encode();
    written[i] = bytes ? write_file_atomically(folder / encodings[i].name, *bytes) : Result<void>(pass_on(bytes));
  });
  ModelFiles files;
  for (std::size_t i = 0; i < encodings.size(); ++i) {
    if (!written[i]) return pass_on(written[i]);
    files.names.emplace_back(encodings[i].name);
  }
  if (report_json.empty()) return files;
  if (auto done = write_file_atomically(folder / "report.json", report_json); !done) return pass_on(done);
  files.names.emplace_back("report.json");
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
