#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "pipeline/calibration/board/board.h"
#include "pipeline/calibration/observations.h"
#include "pipeline/storage/manifest.h"

namespace scanrig {

/// A measured distance of two corners of a board, and its standard uncertainty.
struct BoardLength {
  int from = 0;  ///< as in Board::corner()
  int to = 0;
  double mm = 0.0;
  double sigma_mm = 0.0;
};

/// One stereo pair of a board, as a file list or file names give it.
struct CalibrationPair {
  std::string name;  ///< for reports: "placement 4 image 3", or what the file names share
  int placement = 0;
  bool in_a = true;  ///< takes part in calibration A, of A against B
  bool in_b = true;
  std::optional<double> table_deg{};  ///< as reported, counter-clockwise seen from above; none: held by hand
  std::array<std::filesystem::path, 2> files{};
  std::array<std::string, 2> sha256{};  ///< as listed; empty: not listed
};

/// A folder of calibration images: docs/reference/calibration-images.md. What a folder without a list leaves open is
/// empty or none.
struct CalibrationImages {
  std::filesystem::path folder;
  std::string pixel_format;
  std::array<std::string, 2> serials{};  ///< left, right
  std::array<double, 2> focal_px{};      ///< nominal; 0: not given
  std::optional<double> table_radius_mm{};
  std::optional<Board> board{};
  std::optional<RimDots> rim_dots{};
  std::vector<BoardLength> lengths{};
  std::vector<CalibrationPair> pairs{};

  /// Every pair has a table angle; else none has one.
  [[nodiscard]] bool is_on_table() const { return !pairs.empty() && pairs.front().table_deg.has_value(); }
};

/// The pair that a view of a calibration job is: `pose` is its placement's place in the plan. `folder`: the job's.
/// Files are empty until the view is stored.
CalibrationPair calibration_pair(const std::filesystem::path& folder, std::size_t pose, const ViewRecord& view);

/// The pairs of a folder: those of its calibration_images.json, of a calibration job (scan.json), else all NAME_left.*
/// with their NAME_right.* (PNG or JPEG), by name. Fails with `not_found` (no folder, no pairs, a file without its
/// partner), `io`, `invalid_input` (the list, naming file and key; the folder of another scan), `unsupported`
/// (version).
Result<CalibrationImages> read_calibration_images(const std::filesystem::path& folder);

/// One image of a pair as the sensor delivered it; `side` 0 is left. Fails with `not_found`, `io`, `invalid_input` (not
/// an image, another content than the list's hash).
Result<cv::Mat> load_calibration_image(const CalibrationPair& pair, std::size_t side);

}  // namespace scanrig
