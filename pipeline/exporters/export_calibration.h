#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/camera.h"
#include "pipeline/exporters/lens_fit.h"
#include "pipeline/storage/manifest.h"

namespace scanrig {

/// A text file for another program; `path` is below the folder that is written.
struct ExportedFile {
  std::string path, text;
};

/// A calibration in another program's format. What its lens model leaves of the lens field is in `lenses` (left, right)
/// and in a comment of each file.
struct CalibrationExport {
  std::vector<ExportedFile> files;
  std::array<LensFit, 2> lenses;
  std::string lens_model;  ///< the program's name of it
};

/// left.cameramodel and right.cameramodel of mrcal; its reference frame is the turntable's, in mm.
CalibrationExport export_mrcal(const Calibration& calibration);

/// calibration.yaml for cv::FileStorage: K1 D1 K2 D2 R T as of cv::stereoCalibrate(), and the turntable.
CalibrationExport export_opencv(const Calibration& calibration);

/// How the images of a COLMAP model are named.
enum class ColmapNames {
  of_scan,  ///< the plain images of the scan folder, as the sensors delivered them
  of_copy,  ///< colmap_image_name(): demosaiced copies
};

/// pose1/cameras.txt, images.txt and points3D.txt (empty) for each pose of a scan: both images of each view. The world
/// is the pose's object, in mm: the turntable frame at table angle 0. Fails with `invalid_input`: not a scan of images,
/// or one without views.
Result<CalibrationExport> export_colmap(const Calibration& calibration, const Manifest& manifest, ColmapNames names);

/// "pose1/view00_left.png"; `pose` from 0, `side` 0 is left.
std::string colmap_image_name(std::size_t pose, const ViewRecord& view, std::size_t side);

/// What is lost of a lens, as a sentence; empty: nothing.
std::string what_is_lost(const CalibrationExport& exported, std::size_t side);

}  // namespace scanrig
