#pragma once

#include <vector>

#include "pipeline/calibration/camera.h"
#include "pipeline/mesh/surface_index.h"
#include "pipeline/range/range_image.h"
#include "tests/bench/pose/campaign_objects.h"

/// The default rig at a reduced image size: range images made by casting rays at a mesh, with the errors of a real one.
namespace scanrig::campaign {

/// The rig as it is, and as its calibration has it: off by a draw from the covariance in its `quality`.
struct Rig {
  Calibration truth;
  Calibration calibration;
};
Rig draw_rig(Chance& chance);

/// One pose of one object.
struct Placed {
  const Mesh& mesh;
  const SurfaceIndex& surface;
  Transform pose_from_object;
};

/// A measured point without its noise: where the calibrated left camera has it, and where it is in the pose.
struct Mark {
  int view = 0;  ///< View::index
  Eigen::Vector3d in_camera, in_pose;
};

struct Scan {
  std::vector<View> views;
  std::vector<Mark> marks;  ///< some hundred a view
};

struct ScanOptions {
  int views = 8;
  double max_angle_error_deg = 0.05;  ///< of a reported table angle; the mean of a pose's is 0
};

/// The views of one pose as the range stage hands them over, cropped to the object, in the frame of the calibration.
Scan scan(const Placed& placed, const Rig& rig, const ScanOptions& options, Chance& chance);

}  // namespace scanrig::campaign
