#pragma once

#include <filesystem>
#include <optional>

#include "core/result.h"
#include "core/transform.h"
#include "pipeline/mesh/mesh.h"
#include "pipeline/storage/scan_folder.h"

namespace scanrig::bench {

/// Comparison of a Stanford dragon model with the data that came with the scans. Nothing is aligned: the model is in
/// pose 1's turntable frame. Its place in the frame of the published poses follows from the scans' own files.
struct DragonMeasure {
  double measured_area_mm2 = 0.0;
  double measured_share = 0.0;  ///< of the model's area
  double median_mm = 0.0;       ///< measured area (`views` >= 1) to the merged mesh, point to surface
  double p95_mm = 0.0;
  struct Pose2 {
    double rotation_deg = 0.0;
    double translation_mm = 0.0;  ///< at the object's centre (of the merged mesh's area)
  };
  std::optional<Pose2> pose2;  ///< against the pose given for the side scans; only of a model of two poses
};

/// `data`: the folder with stand/, side/ and recon/. `scan`: imported from stand/, and from side/ if it has two poses.
/// Fails as reading the files, and with `invalid_input` where the scan's views are not those of the .conf.
Result<DragonMeasure> measure_dragon(const std::filesystem::path& data, const ScanFolder& scan, const Mesh& model,
                                     const std::optional<Transform>& pose1_from_pose2);

}  // namespace scanrig::bench
