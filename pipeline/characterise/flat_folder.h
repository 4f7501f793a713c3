#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/characterise/characterise.h"

namespace scanrig {

/// Flat images of a folder, docs/reference/characterisation.md: SIDE_dark_NN.png, SIDE_EXPOSUREus_NN.png, two files a
/// pair in the order of their numbers; and flats.json, if there is one.
struct FlatFolder {
  std::array<std::string, 2> serials;        ///< left, right; empty: not known
  std::array<std::string, 2> gain_settings;  ///< likewise
  std::array<std::vector<FlatPair>, 2> pairs;
};

/// Fails with `not_found` (no folder, no flat image), `invalid_input` (one image of a pair only, an image or a list
/// that cannot be read), `io`.
Result<FlatFolder> read_flat_folder(const std::filesystem::path& folder);

/// Name of a file: side 0 left; `exposure_us` 0: dark; `number` from 1.
std::string flat_file_name(std::size_t side, double exposure_us, int number);
/// Content of flats.json.
std::string flat_list(const std::array<std::string, 2>& serials, const std::array<std::string, 2>& gain_settings);
inline constexpr const char* kFlatList = "flats.json";

}  // namespace scanrig
