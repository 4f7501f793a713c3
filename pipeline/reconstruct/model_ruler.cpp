#include "pipeline/reconstruct/model_ruler.h"

#include <cmath>
#include <limits>
#include <system_error>

#include "pipeline/mesh/solid_properties.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/model_io/mesh_reader.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

struct PickedPoint {
  RulerEnd end;
  Eigen::Vector3d normal;
};

PickedPoint picked_point(const Mesh& mesh, const SurfaceIndex::Nearest& nearest) {
  PickedPoint found;
  found.end.point = nearest.point;
  const auto& face = mesh.faces[nearest.face];
  const Eigen::Vector3d a = mesh.vertices[face[0]].cast<double>();
  const Eigen::Vector3d along = mesh.vertices[face[1]].cast<double>() - a;
  const Eigen::Vector3d across = mesh.vertices[face[2]].cast<double>() - a;
  found.normal = along.cross(across).normalized();
  // An end is as uncertain as the least certain corner of its face.
  found.end.is_measured = mesh.views.size() == mesh.vertices.size() && mesh.sigma.size() == mesh.vertices.size();
  for (const auto corner : face) {
    if (!found.end.is_measured) break;
    found.end.is_measured = mesh.views[corner] > 0 && std::isfinite(mesh.sigma[corner]);
    found.end.sigma_mm = std::max<double>(found.end.sigma_mm, mesh.sigma[corner]);
  }
  if (!found.end.is_measured) found.end.sigma_mm = std::numeric_limits<double>::quiet_NaN();
  return found;
}

}  // namespace

struct ModelRuler::Model {
  fs::path folder;
  fs::file_time_type written;
  Mesh mesh;
  SurfaceIndex index;
  std::optional<double> point_sigma_mm;  // of the calibration
  std::optional<double> scale_sigma;     // of the calibration, relative
};

Result<std::shared_ptr<const ModelRuler::Model>> ModelRuler::open(const fs::path& job_folder) {
  const auto file = job_folder / "model" / "model.ply";
  std::error_code error;
  const auto written = fs::last_write_time(file, error);
  if (error) return fail(ErrorCode::not_found, "ruler: {} has no model", job_folder.filename().string());
  if (last_ && last_->folder == job_folder && last_->written == written) return last_;
  last_.reset();  // two large models need not be in memory at once
  auto mesh = read_ply(file);
  if (!mesh) return pass_on(mesh, "ruler");
  auto index = SurfaceIndex::create(*mesh);
  if (!index) return pass_on(index, "ruler");
  auto model = std::make_shared<Model>(Model{job_folder, written, std::move(*mesh), std::move(*index), {}, {}});
  if (const auto calibration = read_calibration(job_folder / "calibration.json"); calibration && calibration->quality) {
    const auto& quality = *calibration->quality;
    model->point_sigma_mm = 1e-3 * quality.volume_um;
    if (quality.board && quality.board->scale_sigma > 0.0) model->scale_sigma = quality.board->scale_sigma;
  }
  return last_ = std::move(model);
}

Result<ModelLength> ModelRuler::measure(const fs::path& job_folder, const Eigen::Vector3d& from,
                                        const Eigen::Vector3d& to) {
  const std::scoped_lock lock(mutex_);
  const auto opened = open(job_folder);
  if (!opened) return pass_on(opened);
  const Model& model = **opened;
  std::array<PickedPoint, 2> ends;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto nearest = model.index.nearest(i == 0 ? from : to, kReachMm);
    if (!std::isfinite(nearest.distance)) {
      return fail(ErrorCode::invalid_input, "ruler: the {} point is farther than {:g} mm from the model",
                  i == 0 ? "first" : "second", kReachMm);
    }
    ends[i] = picked_point(model.mesh, nearest);
  }
  ModelLength length;
  length.from = ends[0].end;
  length.to = ends[1].end;
  const Eigen::Vector3d line = length.to.point - length.from.point;
  length.mm = line.norm();
  const bool is_known = length.from.is_measured && length.to.is_measured && model.point_sigma_mm && model.scale_sigma;
  if (!is_known) return length;
  double variance = std::pow(*model.scale_sigma * length.mm, 2);
  for (const PickedPoint& one : ends) {
    // Along a line of no length every direction counts.
    const double share = length.mm > 0.0 ? std::abs(one.normal.dot(line)) / length.mm : 1.0;
    variance += std::pow(one.end.sigma_mm * share, 2) + std::pow(*model.point_sigma_mm, 2);
  }
  length.expanded_uncertainty_mm = 2.0 * std::sqrt(variance);
  return length;
}

}  // namespace scanrig
