#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/range/range_image.h"

namespace scanrig {

/// Coarse coloured meshes to watch a scan grow, mm, in the pose's turntable frame at table angle 0. Not for measuring.

/// The photograph of a view.
struct LivePhoto {
  Transform turntable_from_pose = Transform::Identity();  ///< at the view's table angle
  cv::Mat3b image;                                        ///< BGR, linear, the left camera's; empty: grey
  double gain = 1.0;                                      ///< of its values; the same for all views of a pose
};

/// The gain that shows the surface about as bright as the finished texture; that one takes the lamps' directions out
/// too, which one view does not tell.
double live_gain(const View& view, const Camera& left, const LivePhoto& photo);

/// One view's range image on a grid of at most `max_vertices`; neighbours across a step are not joined.
Mesh live_mesh_of_view(const View& view, const Camera& left, const LivePhoto& photo, std::size_t max_vertices = 4000);

/// Colours each vertex as the view shows it that looks at it most directly; grey where none does. `mesh.normals` are
/// needed. `photo_of`: of each view, one after another.
void colour_by_views(Mesh& mesh, const std::vector<View>& views, const Camera& left,
                     const std::function<LivePhoto(std::size_t)>& photo_of);

}  // namespace scanrig
