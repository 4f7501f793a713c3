#include "pipeline/importers/import_meshes.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <system_error>

#include "core/files.h"
#include "core/parallel.h"
#include "pipeline/importers/mesh_view.h"
#include "pipeline/pose/place_views.h"
#include "pipeline/registration/range_surface.h"
#include "pipeline/storage/grid_surface.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig {
namespace {

constexpr int kMinMeasured = 300;     ///< pixels of a view; fewer are no surface to compare
constexpr int kHeightSamples = 4000;  ///< of a view, for the pose's frame

/// The files' views in their own frames.
struct ReadViews {
  std::vector<ResampledGrid> grids;
  std::vector<View> views;
};

Result<ReadViews> read_views(std::span<const std::filesystem::path> files, double unit_mm, const Context& context) {
  std::vector<Result<ResampledGrid>> read(files.size(), fail(ErrorCode::stopped, "stopped by request"));
  parallel_for(files.size(), [&](std::size_t i) {
    if (!context.stopped()) read[i] = read_view(files[i], unit_mm);
  });
  ReadViews all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!read[i]) return pass_on(read[i]);
    View& view = all.views.emplace_back();
    view.index = static_cast<int>(i);
    view.range = range_image_of_grid(read[i]->grid, read[i]->camera_from_scan, read[i]->depth);
    const int measured = cv::countNonZero(view.range.depth == view.range.depth);  // NaN differs from itself
    if (measured < kMinMeasured) {
      return fail(ErrorCode::invalid_input, "{}: shows only {} points of a surface, at least {} are needed",
                  files[i].string(), measured, kMinMeasured);
    }
    all.grids.push_back(std::move(*read[i]));
  }
  return all;
}

/// Origin under the middle of what all views measured, at the 0.1th percentile of its heights.
Transform pose_from_model(const ReadViews& read, const PlacedViews& placed) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<double> heights;
  for (std::size_t v = 0; v < read.views.size(); ++v) {
    if (!placed.model_from_view[v]) continue;
    const RangeImage& range = read.views[v].range;
    const Transform model_from_camera = *placed.model_from_view[v] * range.camera_from_pose.inverse();
    for (const SurfacePoint& s : sample_image(range, kHeightSamples)) {
      const Eigen::Vector3d p = model_from_camera * s.point;
      sum += p;
      heights.push_back(p.y());
    }
  }
  const auto count = static_cast<double>(heights.size());
  const auto lowest = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 1000);
  std::nth_element(heights.begin(), lowest, heights.end());
  Transform transform = Transform::Identity();
  transform.translation() = -Eigen::Vector3d(sum.x() / count, *lowest, sum.z() / count);
  return transform;
}

Result<void> write_views(ScanFolder& scan, const ReadViews& read, const PlacedViews& placed) {
  const Transform pose = pose_from_model(read, placed);
  int index = 0;
  for (std::size_t v = 0; v < read.views.size(); ++v) {
    if (!placed.model_from_view[v]) continue;
    ViewRecord record;
    record.index = index++;
    record.grid = read.grids[v].grid;
    record.camera_from_pose = read.grids[v].camera_from_scan * (pose * *placed.model_from_view[v]).inverse();
    if (auto added = scan.add_range_view(0, std::move(record), read.grids[v].depth); !added) return added;
  }
  return scan.complete_pose(0, "scanned");
}

std::string record_of(const MeshImport& import, const PlacedViews& placed,
                      std::span<const std::filesystem::path> files) {
  nlohmann::ordered_json views = nlohmann::ordered_json::array(), left_out = views, links = views;
  for (const auto& used : import.used) views.push_back({{"view", used.view}, {"file", used.file.string()}});
  for (const auto& out : import.left_out) {
    left_out.push_back({{"file", out.file.string()}, {"sentence", out.sentence}});
  }
  for (const ViewLink& link : placed.links) {
    links.push_back({{"files", {files[link.view1].string(), files[link.view2].string()}},
                     {"overlap", link.overlap},
                     {"median_mm", link.median_mm}});
  }
  const nlohmann::ordered_json all{{"format", "scanrig-import"}, {"version", 1},   {"views", views},
                                   {"left_out", left_out},       {"links", links}, {"median_mm", import.median_mm}};
  return all.dump(1) + "\n";
}

/// Under the folder's name only when it is whole.
Result<void> write_folder(const std::filesystem::path& out, const ReadViews& read, const PlacedViews& placed,
                          const std::string& record) {
  std::filesystem::path prepared = out;
  prepared += ".new";
  std::error_code ignored;
  std::filesystem::remove_all(prepared, ignored);
  Manifest manifest;
  manifest.id = out.filename().string();
  manifest.source = "range";
  Result<void> done;
  if (auto scan = ScanFolder::create(prepared, manifest, {}); scan) {
    done = write_views(*scan, read, placed);
  } else {
    done = pass_on(scan);
  }
  if (done) done = write_file_atomically(prepared / "import.json", record);
  if (done) done = replace_folder(prepared, out);
  if (!done) std::filesystem::remove_all(prepared, ignored);
  return done;
}

MeshImport sorted_out(const PlacedViews& placed, std::span<const std::filesystem::path> files) {
  MeshImport import;
  import.median_mm = placed.median_mm;
  for (std::size_t v = 0; v < files.size(); ++v) {
    if (placed.model_from_view[v]) {
      import.used.push_back({files[v], static_cast<int>(import.used.size())});
      continue;
    }
    import.left_out.push_back(
        {files[v], fmt::format("{} is not used: it does not fit the others in one way only; check that it shows the "
                               "same object and shares surface with them",
                               files[v].string())});
  }
  return import;
}

/// A name with a trailing slash has no last part.
std::filesystem::path without_slash(const std::filesystem::path& folder) {
  return folder.has_filename() ? folder : folder.parent_path();
}

}  // namespace

Result<MeshImport> import_meshes(std::span<const std::filesystem::path> files, const std::filesystem::path& out_folder,
                                 const MeshImportOptions& options, const Context& context) {
  const std::filesystem::path out = without_slash(out_folder);
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return fail(ErrorCode::exists, "{}: already there; name another folder with --out", out.string());
  }
  if (files.size() < 2 || files.size() > kMaxUnknownViews) {
    return fail(ErrorCode::invalid_input, "import: {} scan{}, but 2 to {} can be joined; name the scans of one object",
                files.size(), files.size() == 1 ? "" : "s", kMaxUnknownViews);
  }
  const auto read = read_views(files, options.unit_mm, context);
  if (!read) return pass_on(read);
  const auto placed = place_views(read->views, {}, context);
  if (!placed) return pass_on(placed, "import");
  MeshImport import = sorted_out(*placed, files);
  if (import.used.empty()) {
    return fail(ErrorCode::no_overlap,
                "import: no two of the {} scans fit together in one way only; scan the object again with more overlap",
                files.size());
  }
  if (auto written = write_folder(out, *read, *placed, record_of(import, *placed, files)); !written) {
    return pass_on(written);
  }
  return import;
}

}  // namespace scanrig
