#include "pipeline/characterise/characterisation_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/strict_json.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormat = "scanrig-characterisation";
constexpr int kMaxPixels = 1 << 16;

/// Of a value that may not be known.
constexpr const char* kPrnu = "prnu";
constexpr const char* kSaturation = "saturation";

struct Key {
  const char* name;
  double SensorCharacterisation::*member;
};

/// Numbers that are always known.
constexpr Key kKeys[] = {{"gamma", &SensorCharacterisation::gamma},
                         {"gain", &SensorCharacterisation::gain},
                         {"gain_sigma", &SensorCharacterisation::gain_sigma},
                         {"black", &SensorCharacterisation::black},
                         {"read_noise", &SensorCharacterisation::read_noise},
                         {"dsnu", &SensorCharacterisation::dsnu},
                         {"column", &SensorCharacterisation::column},
                         {"row", &SensorCharacterisation::row},
                         {"linearity_error", &SensorCharacterisation::linearity_error},
                         {"light_change", &SensorCharacterisation::light_change}};

ordered_json to_json(const SensorCharacterisation& camera) {
  ordered_json json{{"serial", camera.serial},
                    {"gain_setting", camera.gain_setting},
                    {"width", camera.width},
                    {"height", camera.height},
                    {"bits", camera.bits}};
  for (const Key& key : kKeys) json[key.name] = camera.*key.member;
  if (std::isfinite(camera.prnu)) json[kPrnu] = camera.prnu;
  if (std::isfinite(camera.saturation)) json[kSaturation] = camera.saturation;
  json["curve"] = ordered_json::array();
  for (const TransferPoint& point : camera.curve) {
    json["curve"].push_back({{"exposure_us", point.exposure_us}, {"grey", point.grey}, {"variance", point.variance}});
  }
  json["hot_pixels"] = ordered_json::array();
  for (const HotPixel& pixel : camera.hot_pixels) {
    json["hot_pixels"].push_back({{"x", pixel.x}, {"y", pixel.y}, {"excess", pixel.excess}});
  }
  json["remarks"] = camera.remarks;
  return json;
}

SensorCharacterisation read_camera(JsonObject& object) {
  SensorCharacterisation camera;
  camera.serial = object.text("serial");
  camera.gain_setting = object.text("gain_setting");
  camera.width = object.integer("width", 1, kMaxPixels);
  camera.height = object.integer("height", 1, kMaxPixels);
  camera.bits = object.integer("bits", 1, 16);
  for (const Key& key : kKeys) camera.*key.member = object.number(key.name);
  camera.prnu = object.has(kPrnu) ? object.number(kPrnu, 0.0) : std::numeric_limits<double>::quiet_NaN();
  if (object.has(kSaturation)) camera.saturation = object.number(kSaturation, 0.0);
  for (JsonObject& point : object.objects("curve")) {
    camera.curve.push_back({point.number("exposure_us", 0.0), point.number("grey"), point.number("variance")});
    point.close();
  }
  for (JsonObject& pixel : object.objects("hot_pixels")) {
    camera.hot_pixels.push_back(
        {pixel.integer("x", 0, kMaxPixels), pixel.integer("y", 0, kMaxPixels), pixel.number("excess")});
    pixel.close();
  }
  camera.remarks = object.texts("remarks");
  if (!(camera.gain > 0.0)) object.reject("gain", "must be above 0");
  object.close();
  return camera;
}

}  // namespace

Result<SensorCharacterisation> CharacterisationFile::of_camera(std::string_view serial) const {
  const auto found = std::ranges::find(cameras, serial, &SensorCharacterisation::serial);
  if (found != cameras.end()) return *found;
  std::vector<std::string> known;
  for (const SensorCharacterisation& camera : cameras) known.push_back(camera.serial);
  return fail(ErrorCode::not_found,
              "the characterisation is of camera {}, not of {}; run scanrig camera characterise with this one",
              fmt::join(known, " and "), serial);
}

std::string encode_characterisation(const CharacterisationFile& file) {
  ordered_json json{{"format", kFormat}, {"version", 1}, {"date", file.date}, {"cameras", ordered_json::array()}};
  for (const SensorCharacterisation& camera : file.cameras) json["cameras"].push_back(to_json(camera));
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Result<CharacterisationFile> read_characterisation(const std::filesystem::path& file) {
  auto json = JsonFile::read(file, kFormat, 1);
  if (!json) return pass_on(json);
  CharacterisationFile read;
  read.date = json->root().text("date");
  for (JsonObject& camera : json->root().objects("cameras")) read.cameras.push_back(read_camera(camera));
  if (const auto whole = json->finish(); !whole) return pass_on(whole);
  return read;
}

Result<NoiseModel> noise_model_of(const std::filesystem::path& file, std::string_view serial) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return NoiseModel{};
  const auto read = read_characterisation(file);
  if (!read) return pass_on(read);
  const auto camera = read->of_camera(serial);
  if (!camera) return pass_on(camera, file.string());
  return camera->noise_model();
}

}  // namespace scanrig
