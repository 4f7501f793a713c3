#pragma once

#include <string>

#include "pipeline/calibrate/calibrate_images.h"

/// The sections of the report on a calibration, in the order of the page; each is HTML. Empty: nothing to show.
namespace scanrig::report {

std::string left_out_section(const FolderCalibration& outcome);
std::string residual_section(const FolderCalibration& outcome);
std::string coverage_section(const FolderCalibration& outcome);
std::string sigma_section(const FolderCalibration& outcome);
std::string cross_validation_section(const FolderCalibration& outcome);
std::string lens_section(const FolderCalibration& outcome);
std::string board_section(const FolderCalibration& outcome);
std::string turntable_section(const FolderCalibration& outcome);

inline const char* side_name(std::size_t camera) { return camera == 0 ? "left" : "right"; }

}  // namespace scanrig::report
