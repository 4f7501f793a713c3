// bench_fusion SCAN OUT VOXEL_MM ROUNDS: registered range images of a rendered scan of two poses for other programs, as
// files in OUT, beside the times in which this project finds the pose and integrates just these images.
// OUT: POSE_VIEW.f32, rows of depth in mm, NaN where unmeasured; own.ply, the surface; views.json: projections, where
// each camera was, true and found motion between the poses, seconds, of wall and processor, also of an integration
// without mending. Watch and texture have no part in it.

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "pipeline/evaluate/truth_file.h"
#include "pipeline/model_io/model_files.h"
#include "pipeline/pose/estimate_pose.h"
#include "pipeline/range/rectification.h"
#include "pipeline/range/view_builder.h"
#include "pipeline/registration/refine_pose.h"
#include "pipeline/registration/register_views.h"
#include "pipeline/storage/scan_folder.h"
#include "pipeline/volume/integrate.h"

namespace {

using namespace scanrig;
namespace fs = std::filesystem;

constexpr double kPartialVoxelMm = 0.8;  // as a reconstruction takes for partial models

struct Pose {
  std::vector<View> views;
  Surface partial;
};

/// Wall seconds and seconds of the processor, all threads together.
template <class Work>
nlohmann::json seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t used = std::clock();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          static_cast<double>(std::clock() - used) / CLOCKS_PER_SEC};
}

nlohmann::json rows_of(const Transform& transform) {
  nlohmann::json rows = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    rows.push_back({transform.matrix()(row, 0), transform.matrix()(row, 1), transform.matrix()(row, 2),
                    transform.matrix()(row, 3)});
  }
  return rows;
}

Result<Pose> measured_pose_of(const ScanFolder& scan, const Rectification& rectification, double gear, std::size_t p,
                              nlohmann::json& partial_seconds) {
  Pose pose;
  const std::size_t count = scan.manifest().poses[p].views.size();
  for (std::size_t v = 0; v < count; ++v) {
    const auto images = scan.load_images(p, v);
    if (!images) return pass_on(images);
    auto view =
        make_view(rectification, {images->left_pattern, images->right_pattern, images->left_plain, images->right_plain},
                  gear * images->angle_rad, images->index, {}, {});
    if (!view) return pass_on(view);
    pose.views.push_back(std::move(*view));
  }
  if (const auto done = register_views(pose.views, {}, {}); !done) return pass_on(done);
  const PosedViews posed{.views = pose.views};
  Result<Surface> partial = fail(ErrorCode::internal, "not integrated");
  partial_seconds.push_back(seconds_of([&] {
    partial =
        integrate({&posed, 1}, {.voxel_mm = kPartialVoxelMm, .table_without_silhouettes = true, .untangle = false}, {});
  }));
  if (!partial) return pass_on(partial);
  pose.partial = std::move(*partial);
  return pose;
}

Result<Transform> found_motion(const std::vector<Pose>& poses) {
  const PoseInput first{.solid = poses[0].partial.mesh, .views = poses[0].views};
  const PoseInput second{.solid = poses[1].partial.mesh, .views = poses[1].views};
  const auto estimate = estimate_pose(first, second, {}, {});
  if (!estimate) return pass_on(estimate);
  const auto refined = refine_pose(poses[0].views, poses[1].views, estimate->pose1_from_pose2,
                                   {.contacts = estimate->best.contacts}, {});
  if (!refined) return pass_on(refined);
  return refined->pose1_from_pose2;
}

nlohmann::json write_views(const std::vector<Pose>& poses, const Transform& pose1_from_pose2, const fs::path& out) {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t p = 0; p < poses.size(); ++p) {
    const Transform pose_from_model = p == 0 ? Transform::Identity() : Transform(pose1_from_pose2.inverse());
    for (const View& view : poses[p].views) {
      const RangeImage& range = view.range;
      const std::string name = fmt::format("{}_{}.f32", p + 1, view.index);
      const cv::Mat1f depth = range.depth.clone();  // without gaps between its rows
      std::ofstream(out / name, std::ios::binary)
          .write(reinterpret_cast<const char*>(depth.data),
                 static_cast<std::streamsize>(depth.total() * sizeof(float)));
      const Projection& lens = range.projection;
      all.push_back({{"file", name},
                     {"pose", p + 1},
                     {"width", lens.width},
                     {"height", lens.height},
                     {"fx", lens.fx},
                     {"fy", lens.fy},
                     {"cx", lens.cx},
                     {"cy", lens.cy},
                     {"camera_from_pose", rows_of(range.camera_from_pose)},
                     {"camera_from_model", rows_of(range.camera_from_pose * pose_from_model)}});
    }
  }
  return all;
}

Result<nlohmann::json> measure(const fs::path& folder, const fs::path& out, double voxel_mm, int rounds) {
  auto scan = ScanFolder::open(folder);
  if (!scan) return pass_on(scan);
  const auto calibration = scan->load_calibration();
  if (!calibration) return pass_on(calibration);
  const auto rectification = rectify(*calibration);
  if (!rectification) return pass_on(rectification);
  const auto truth = read_truth(folder);
  if (!truth) return pass_on(truth);
  if (scan->manifest().poses.size() != 2 || !truth->pose1_from_pose2) {
    return fail(ErrorCode::invalid_input, "{} is not a scan of two poses with its truth", folder.string());
  }
  const double gear = calibration->quality ? calibration->quality->gear : 1.0;
  nlohmann::json json;
  std::vector<Pose> poses;
  for (std::size_t p = 0; p < 2; ++p) {
    auto pose = measured_pose_of(*scan, *rectification, gear, p, json["partial_seconds"]);
    if (!pose) return pass_on(pose);
    poses.push_back(std::move(*pose));
  }

  Result<Transform> motion = fail(ErrorCode::internal, "not searched");
  Result<Surface> surface = fail(ErrorCode::internal, "not integrated");
  for (int round = 0; round < rounds; ++round) {
    json["pose_seconds"].push_back(seconds_of([&] { motion = found_motion(poses); }));
    if (!motion) return pass_on(motion);
    const std::vector<PosedViews> posed = {{.views = poses[0].views},
                                           {.views = poses[1].views, .model_from_pose = *motion}};
    const VolumeOptions options{.voxel_mm = voxel_mm, .table_without_silhouettes = true};
    VolumeOptions bare = options;
    bare.repair_handles = bare.untangle = false;
    json["bare_seconds"].push_back(seconds_of([&] { surface = integrate(posed, bare, {}); }));
    if (surface) json["integration_seconds"].push_back(seconds_of([&] { surface = integrate(posed, options, {}); }));
    if (!surface) return pass_on(surface);
  }
  json["views"] = write_views(poses, *motion, out);
  json["pose1_from_pose2"] = rows_of(*motion);
  json["true_pose1_from_pose2"] = rows_of(*truth->pose1_from_pose2);
  std::ofstream(out / "own.ply", std::ios::binary) << encode_ply(surface->mesh);
  std::ofstream(out / "views.json") << json.dump(1) << "\n";
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5 || std::atof(argv[3]) <= 0.0 || std::atoi(argv[4]) < 1) {
    fmt::print(stderr, "usage: bench_fusion SCAN OUT VOXEL_MM ROUNDS\n");
    return static_cast<int>(ExitCode::usage);
  }
  fs::create_directories(argv[2]);
  Result<nlohmann::json> json;
  with_threads(0, [&] { json = measure(argv[1], argv[2], std::atof(argv[3]), std::atoi(argv[4])); });
  if (!json) {
    fmt::print(stderr, "{}\n", json.error().message);
    return static_cast<int>(exit_code(json.error().code));
  }
  return 0;
}
