#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/characterise/characterise.h"

namespace scanrig {

inline constexpr const char* kCharacterisationFile = "characterisation.json";  ///< beside calibration.json

/// characterisation.json: what is known of the rig's cameras. docs/reference/characterisation.md.
struct CharacterisationFile {
  std::string date;  ///< ISO 8601
  std::vector<SensorCharacterisation> cameras;

  /// Of the camera with this serial number. Fails with `not_found`: the file is of other cameras.
  [[nodiscard]] Result<SensorCharacterisation> of_camera(std::string_view serial) const;
};

std::string encode_characterisation(const CharacterisationFile& file);
/// Fails with `not_found`, `io`, `invalid_input`, `unsupported`.
Result<CharacterisationFile> read_characterisation(const std::filesystem::path& file);

/// The noise of a camera: as characterised, or the assumption where there is no such file. Fails as
/// read_characterisation() and of_camera() where there is one.
Result<NoiseModel> noise_model_of(const std::filesystem::path& file, std::string_view serial);

}  // namespace scanrig
