#include <nlohmann/json.hpp>
#include <span>

#include "core/catch_exceptions.h"
#include "core/files.h"
#include "core/image_codec.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"
#include "pipeline/exporters/export_calibration.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig::ctl {
namespace {

namespace fs = std::filesystem;

Result<Calibration> calibration_of(const fs::path& from) {
  std::error_code ignored;
  return read_calibration(fs::is_directory(from, ignored) ? from / "calibration.json" : from);
}

Result<void> write_below(const fs::path& folder, const std::string& path, std::span<const std::byte> bytes) {
  const fs::path file = folder / path;
  if (auto made = create_directories_synced(file.parent_path()); !made) return made;
  const std::string name = file.filename().string();
  const std::array<FileContent, 1> content{{{name, bytes}}};
  return write_files_synced(file.parent_path(), content);
}

/// Copies of the plain images of a scan, demosaiced, below `folder`.
Result<void> write_images(const ScanFolder& scan, const fs::path& folder) {
  for (std::size_t p = 0; p < scan.manifest().poses.size(); ++p) {
    const auto& views = scan.manifest().poses[p].views;
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t side = 0; side < 2; ++side) {
        const auto image = scan.load_usable_image(p, v, side == 0 ? "left_plain" : "right_plain");
        if (!image) return pass_on(image);
        const auto bytes = encode_png(*image);
        if (!bytes) return pass_on(bytes);
        if (auto written = write_below(folder, colmap_image_name(p, views[v], side), *bytes); !written) return written;
      }
    }
  }
  return {};
}

Result<CalibrationExport> exported(const ConvertVerb& verb, const ScanFolder* scan) {
  const auto calibration = scan ? scan->load_calibration() : calibration_of(verb.from);
  if (!calibration) return pass_on(calibration);
  if (verb.what == "mrcal") return export_mrcal(*calibration);
  if (verb.what == "opencv") return export_opencv(*calibration);
  return export_colmap(*calibration, scan->manifest(), verb.images ? ColmapNames::of_copy : ColmapNames::of_scan);
}

/// All files or none, under their own name only when they are whole.
Result<void> write(const ConvertVerb& verb, const CalibrationExport& made, const ScanFolder* scan) {
  if (verb.what == "opencv") return write_file_atomically(verb.out, made.files.front().text);
  fs::path prepared = verb.out;
  prepared += ".new";
  std::error_code ignored;
  fs::remove_all(prepared, ignored);
  Result<void> done = create_directories_synced(prepared);
  for (const ExportedFile& file : made.files) {
    if (done) done = write_below(prepared, file.path, std::as_bytes(std::span(file.text)));
  }
  if (done && scan && verb.images) done = write_images(*scan, prepared / "images");
  if (done) done = replace_folder(prepared, verb.out);
  if (!done) fs::remove_all(prepared, ignored);
  return done;
}

void print_made(const ConvertVerb& verb, const CalibrationExport& made) {
  if (!verb.json) {
    for (std::size_t side = 0; side < 2; ++side) {
      if (const auto lost = what_is_lost(made, side); !lost.empty()) fmt::print("{}\n", lost);
    }
    fmt::print("{}\n", verb.out.string());
    return;
  }
  nlohmann::ordered_json all{{"out", verb.out}, {"lens_model", made.lens_model}};
  for (std::size_t side = 0; side < 2; ++side) {
    all[side == 0 ? "left" : "right"] = {{"rms_px", made.lenses[side].rms_px}, {"max_px", made.lenses[side].max_px}};
  }
  fmt::print("{}\n", all.dump());
}

}  // namespace

ExitCode convert(const ConvertVerb& verb) {
  std::error_code ignored;
  if (fs::exists(verb.out, ignored)) {
    return report_error({ErrorCode::exists, verb.out.string() + ": already there; name another with --out"});
  }
  std::optional<ScanFolder> scan;
  if (verb.what == "colmap") {
    auto opened = ScanFolder::open(verb.from);
    if (!opened) return report_error(opened.error());
    scan = std::move(*opened);
  }
  const ScanFolder* views = scan ? &*scan : nullptr;
  const auto made = catch_exceptions("the export", [&] { return exported(verb, views); });
  if (!made) return report_error(made.error());
  const auto written = catch_exceptions("the export", [&] { return write(verb, *made, views); });
  if (!written) return report_error(written.error());
  print_made(verb, *made);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
