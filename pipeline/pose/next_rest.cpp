#include "pipeline/pose/next_rest.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/units.h"
#include "pipeline/pose/convex_hull.h"

namespace scanrig {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Samples of the unseen surface, then of the measured one; `unseen` of them, each worth the same share of all surface.
struct Samples {
  std::vector<SurfaceSample> all;
  std::size_t unseen = 0;
  double share_of_unseen = 0.0, share_of_measured = 0.0;  ///< of one sample
};

/// The facets of a mesh waver about its surface: the normals of its vertices do so less.
void smooth_normals(const Mesh& mesh, std::vector<SurfaceSample>& samples) {
  const bool has_normals = mesh.normals.size() == mesh.vertices.size();
  const std::vector<Eigen::Vector3f> made = has_normals ? std::vector<Eigen::Vector3f>() : vertex_normals(mesh);
  const std::vector<Eigen::Vector3f>& normals = has_normals ? mesh.normals : made;
  for (SurfaceSample& s : samples) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) sum += s.weights[k] * normals[mesh.faces[s.face][k]].cast<double>();
    if (sum.norm() > 0.0) s.normal = sum.normalized();
  }
}

Samples samples_of(const Mesh& partial, std::size_t count) {
  Samples samples;
  const auto closed = measured_faces(partial, false), measured = measured_faces(partial, true);
  const double closed_area = area_of(partial, closed), measured_area = area_of(partial, measured);
  samples.all = sample_surface(partial, closed, count);
  samples.unseen = samples.all.size();
  const auto of_measured = sample_surface(partial, measured, count);
  samples.all.insert(samples.all.end(), of_measured.begin(), of_measured.end());
  smooth_normals(partial, samples.all);
  const double unit = 1.0 / (static_cast<double>(count) * (closed_area + measured_area));
  samples.share_of_unseen = closed_area * unit;
  samples.share_of_measured = measured_area * unit;
  return samples;
}

/// The object on that rest, by the shortest turn, its centre of mass over the axis.
Transform placed_on(const StableRest& rest, const Eigen::Quaterniond& turn, const Eigen::Vector3d& centre_of_mass) {
  Transform turntable_from_pose = Transform::Identity();
  turntable_from_pose.linear() = turn.toRotationMatrix();
  const Eigen::Vector3d centre = turn * centre_of_mass;
  turntable_from_pose.translation() = Eigen::Vector3d(-centre.x(), rest.offset_mm, -centre.z());
  return turntable_from_pose;
}

struct Stiffness {
  double value = 0.0;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
};

Stiffness stiffness_of(const std::vector<const SurfaceSample*>& shared) {
  if (shared.size() < 6) return {};
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SurfaceSample* s : shared) middle += s->point;
  middle /= static_cast<double>(shared.size());
  double reach = 0.0;
  for (const SurfaceSample* s : shared) reach += (s->point - middle).squaredNorm();
  reach = std::sqrt(reach / static_cast<double>(shared.size()));
  Matrix6d normal = Matrix6d::Zero();
  for (const SurfaceSample* s : shared) {
    Vector6d row;
    row << (s->point - middle).cross(s->normal) / reach, s->normal;
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(normal);
  const Vector6d weakest = solver.eigenvectors().col(0);
  const Eigen::Vector3d turn = weakest.head<3>(), shift = weakest.tail<3>();
  const Eigen::Vector3d axis = turn.norm() > shift.norm() ? turn : shift;
  return {6.0 * std::max(0.0, solver.eigenvalues()[0]) / normal.trace(), axis.normalized()};
}

void judge_outlook(NextRest& next, const NextRestOptions& options) {
  if (next.overlap < options.min_overlap) {
    next.outlook = PoseOutlook::small_overlap;
  } else if (next.stiffness < options.min_stiffness) {
    next.outlook = PoseOutlook::weak;
  }
}

/// How many views see each sample; of measured surface one is enough.
std::vector<std::uint8_t> views_of(const Samples& samples, const SurfaceIndex& surface, const Transform& placed,
                                   std::span<const double> angles_rad, const RigEyes& eyes,
                                   const SightOptions& options) {
  const std::span<const SurfaceSample> all = samples.all;
  auto views = views_that_see(all.first(samples.unseen), surface, placed, angles_rad, eyes, options);
  const auto of_measured =
      views_that_see(all.subspan(samples.unseen), surface, placed, angles_rad, eyes, options, /*enough=*/1);
  views.insert(views.end(), of_measured.begin(), of_measured.end());
  return views;
}

/// `views`: how many see each sample.
NextRest predicted(const StableRest& rest, const Samples& samples, const std::vector<std::uint8_t>& views,
                   const NextRestOptions& options) {
  NextRest next{.rest = rest};
  double gain = 0.0;
  std::size_t both = 0;
  std::vector<const SurfaceSample*> shared;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i] == 0) continue;
    if (i < samples.unseen) {
      const bool is_on_table = samples.all[i].point.y() < options.on_table_mm;
      gain += 1.0 - std::pow(1.0 - (is_on_table ? options.chance_on_table : options.chance_of_a_view), views[i]);
    } else {
      ++both;
      shared.push_back(&samples.all[i]);
    }
  }
  const auto unseen = static_cast<double>(samples.unseen);
  const auto measured = static_cast<double>(samples.all.size() - samples.unseen);
  if (samples.unseen > 0) next.gain = gain / unseen;
  next.unseen_after = (unseen - gain) * samples.share_of_unseen;
  const double in_both = static_cast<double>(both) * samples.share_of_measured;
  const double here = measured * samples.share_of_measured, there = in_both + gain * samples.share_of_unseen;
  if (here + there > 0.0) next.overlap = 2.0 * in_both / (here + there);
  const Stiffness stiffness = stiffness_of(shared);
  next.stiffness = stiffness.value;
  next.weak_axis = stiffness.axis;
  return next;
}

bool is_better(const NextRest& a, const NextRest& b) {
  const bool a_findable = a.outlook == PoseOutlook::findable, b_findable = b.outlook == PoseOutlook::findable;
  return a_findable != b_findable ? a_findable : a.gain > b.gain;
}

}  // namespace

Result<NextRests> next_rests(const Mesh& partial, std::span<const double> angles_rad, const RigEyes& eyes,
                             const NextRestOptions& options) {
  if (angles_rad.empty() || partial.views.size() != partial.vertices.size()) {
    return fail(ErrorCode::invalid_input, "next rest: needs table angles and the number of views of each vertex");
  }
  const auto properties = solid_properties(partial);
  if (!properties) return pass_on(properties, "next rest");
  const auto surface = SurfaceIndex::create(partial);
  if (!surface) return pass_on(surface, "next rest");
  const auto stable = rests_on_hull(partial, *properties, 0.0, options.stable);
  if (!stable) return pass_on(stable);

  const Samples samples = samples_of(partial, options.samples);
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitY();
  NextRests found{.unseen = static_cast<double>(samples.unseen) * samples.share_of_unseen, .rests = {}};
  for (const StableRest& rest : stable->rests) {
    const bool is_present = rest.normal.dot(down) > std::cos(to_radians(options.same_rest_deg));
    if (is_present || rest.margin_mm < options.min_margin_mm) continue;
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(rest.normal, down);
    const Transform placed = placed_on(rest, turn, properties->centre_of_mass);
    NextRest next =
        predicted(rest, samples, views_of(samples, *surface, placed, angles_rad, eyes, options.sight), options);
    next.turn = turn;
    judge_outlook(next, options);
    found.rests.push_back(next);
  }
  std::stable_sort(found.rests.begin(), found.rests.end(), is_better);
  return found;
}

int index_of_rest(std::span<const NextRest> suggested, const Eigen::Vector3d& down, double same_deg) {
  const double same = std::cos(to_radians(same_deg));
  const auto at = std::ranges::find_if(suggested, [&](const NextRest& s) { return s.rest.normal.dot(down) > same; });
  return at == suggested.end() ? -1 : static_cast<int>(at - suggested.begin());
}

}  // namespace scanrig
