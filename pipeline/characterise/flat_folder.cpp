#include "pipeline/characterise/flat_folder.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/files.h"
#include "core/image_codec.h"
#include "core/strict_json.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> kFlatSides{"left", "right"};
constexpr const char* kFlatFormat = "scanrig-flats";
constexpr std::string_view kDark = "dark", kMicroseconds = "us";

struct Named {
  std::size_t side = 0;
  double exposure_us = 0.0;
  int number = 0;
};

template <class Number>
bool read_number(std::string_view text, Number& number) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

/// What a file's name tells; nothing: it is no flat image.
std::optional<Named> named(const fs::path& file) {
  if (file.extension() != ".png") return std::nullopt;
  const std::string stem = file.stem().string();
  const auto first = stem.find('_'), last = stem.rfind('_');
  if (first == std::string::npos || first == last) return std::nullopt;
  Named found;
  const std::string_view side = std::string_view(stem).substr(0, first);
  std::string_view exposure = std::string_view(stem).substr(first + 1, last - first - 1);
  if (side != kFlatSides[0] && side != kFlatSides[1]) return std::nullopt;
  found.side = side == kFlatSides[0] ? 0 : 1;
  if (!read_number(std::string_view(stem).substr(last + 1), found.number)) return std::nullopt;
  if (exposure == kDark) return found;
  if (!exposure.ends_with(kMicroseconds)) return std::nullopt;
  exposure.remove_suffix(kMicroseconds.size());
  if (!read_number(exposure, found.exposure_us) || !(found.exposure_us > 0.0)) return std::nullopt;
  return found;
}

Result<cv::Mat> load(const fs::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  auto image = decode_png(*bytes);
  if (!image) return pass_on(image, file.string());
  return image;
}

Result<void> read_list(const fs::path& file, FlatFolder& flats) {
  auto json = JsonFile::read(file, kFlatFormat, 1);
  if (!json) return pass_on(json);
  for (std::size_t side = 0; side < kFlatSides.size(); ++side) {
    JsonObject camera = json->root().object(kFlatSides.at(side));
    flats.serials.at(side) = camera.text("serial");
    flats.gain_settings.at(side) = camera.text("gain_setting");
    camera.close();
  }
  return json->finish();
}

/// Two files of one light and camera, by number.
using Files = std::map<double, std::map<int, fs::path>>;

Result<std::vector<FlatPair>> load_pairs(const Files& files) {
  std::vector<FlatPair> pairs;
  for (const auto& [exposure_us, numbered] : files) {
    for (auto at = numbered.begin(); at != numbered.end(); ++at) {
      const fs::path& one = at->second;
      if (++at == numbered.end()) {
        return fail(ErrorCode::invalid_input, "{}: one image of the pair only; take both", one.string());
      }
      auto first = load(one);
      if (!first) return pass_on(first);
      auto second = load(at->second);
      if (!second) return pass_on(second);
      pairs.push_back({one.stem().string(), exposure_us, std::move(*first), std::move(*second)});
    }
  }
  return pairs;
}

}  // namespace

Result<FlatFolder> read_flat_folder(const fs::path& folder) {
  std::error_code trouble;
  fs::directory_iterator entries(folder, trouble);
  if (trouble) {
    const auto code = fs::exists(folder) ? ErrorCode::io : ErrorCode::not_found;
    return fail(code, "{}: cannot be read: {}", folder.string(), trouble.message());
  }
  std::array<Files, 2> files;
  for (const auto& entry : entries) {
    if (const auto found = named(entry.path())) {
      files.at(found->side)[found->exposure_us][found->number] = entry.path();
    }
  }
  if (files[0].empty() && files[1].empty()) {
    return fail(ErrorCode::not_found, "{}: no flat image such as {}; name a folder of them", folder.string(),
                flat_file_name(0, 2000.0, 1));
  }
  FlatFolder flats;
  if (fs::exists(folder / kFlatList)) {
    if (auto read = read_list(folder / kFlatList, flats); !read) return pass_on(read);
  }
  for (std::size_t side = 0; side < kFlatSides.size(); ++side) {
    auto pairs = load_pairs(files.at(side));
    if (!pairs) return pass_on(pairs);
    flats.pairs.at(side) = std::move(*pairs);
  }
  return flats;
}

std::string flat_file_name(std::size_t side, double exposure_us, int number) {
  const std::string light = exposure_us > 0.0 ? fmt::format("{:.0f}us", exposure_us) : std::string(kDark);
  return fmt::format("{}_{}_{:02}.png", kFlatSides.at(side), light, number);
}

std::string flat_list(const std::array<std::string, 2>& serials, const std::array<std::string, 2>& gain_settings) {
  nlohmann::ordered_json json{{"format", kFlatFormat}, {"version", 1}};
  for (std::size_t side = 0; side < kFlatSides.size(); ++side) {
    json[kFlatSides.at(side)] = {{"serial", serials.at(side)}, {"gain_setting", gain_settings.at(side)}};
  }
  return json.dump(2) + "\n";
}

}  // namespace scanrig
