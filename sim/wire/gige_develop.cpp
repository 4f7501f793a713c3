#include "sim/wire/gige_develop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

namespace scanrig::sim::wire {
namespace {

using Table = std::array<std::uint8_t, 256>;

struct Steps {
  int bin = 1, skip = 1;
  [[nodiscard]] int each() const { return bin * skip; }
};

std::uint8_t grey(double value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)); }

/// Mean of the binned pixels, of every n-th of them, mirrored.
cv::Mat read_sensor(const cv::Mat& sensor, const GigeRegisters& registers) {
  const Steps x{static_cast<int>(registers.number("BinningHorizontal")),
                static_cast<int>(registers.number("DecimationHorizontal"))};
  const Steps y{static_cast<int>(registers.number("BinningVertical")),
                static_cast<int>(registers.number("DecimationVertical"))};
  const bool flip_x = registers.number("ReverseX") != 0, flip_y = registers.number("ReverseY") != 0;
  if (x.each() == 1 && y.each() == 1 && !flip_x && !flip_y) return sensor;
  cv::Mat read(sensor.rows / y.bin / y.skip, sensor.cols / x.bin / x.skip, CV_8U);
  for (int row = 0; row < read.rows; ++row) {
    for (int column = 0; column < read.cols; ++column) {
      const cv::Rect pixels(column * x.each(), row * y.each(), x.bin, y.bin);
      const int to_row = flip_y ? read.rows - 1 - row : row, to_column = flip_x ? read.cols - 1 - column : column;
      read.at<std::uint8_t>(to_row, to_column) = grey(cv::mean(sensor(pixels))[0]);
    }
  }
  return read;
}

/// Values of the camera for those of the sensor; `balance`: factor of the pixel's colour.
Table tone_curve(const GigeRegisters& registers, double nominal_us, double balance) {
  constexpr double kDecibelsPerTen = 20.0;
  double factor = std::pow(10.0, registers.number("Gain") / kDecibelsPerTen) * balance;
  if (nominal_us > 0) factor *= registers.number("ExposureTime") / nominal_us;
  if (registers.entry("ExposureMode") == "TriggerWidth") factor = 0;  // the pulse is short
  const bool has_switch =
      std::ranges::find(registers.features(), "GammaEnable", &GigeFeature::name) != registers.features().end();
  const bool curved = !has_switch || registers.number("GammaEnable") != 0;
  const double gamma = curved ? registers.number("Gamma") : 1.0;
  Table table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    double value = std::clamp(static_cast<double>(i) * factor + registers.number("BlackLevel"), 0.0, 255.0);
    if (registers.number("LUTEnable") != 0) value = 255.0 - value;
    table[i] = grey(255.0 * std::pow(value / 255.0, gamma));
  }
  return table;
}

/// 0 red, 1 green, 2 blue: the colour of a pixel of a Bayer format, named by its first two pixels; 0 for other formats.
std::size_t bayer_colour(const std::string& format, int x, int y) {
  if (!format.starts_with("Bayer")) return 0;
  const std::string upper = format.substr(5, 2);
  const std::string lower = upper == "RG" ? "GB" : upper == "GR" ? "BG" : upper == "GB" ? "RG" : "GR";
  const char letter = (y % 2 == 0 ? upper : lower)[static_cast<std::size_t>(x % 2)];
  return letter == 'R' ? 0 : letter == 'G' ? 1 : 2;
}

cv::Mat develop_tones(const cv::Mat& read, const GigeRegisters& registers, double nominal_us) {
  const std::string format = registers.entry("PixelFormat");
  std::array<Table, 3> tables{};
  bool alike = true;
  for (std::size_t colour = 0; colour < 3; ++colour) {
    const double balance = format.starts_with("Mono") ? 1.0 : registers.number("BalanceRatio", colour);
    tables[colour] = tone_curve(registers, nominal_us, balance);
    alike = alike && tables[colour] == tables[0];
  }
  cv::Mat developed(read.size(), CV_8U);
  std::array<std::array<std::size_t, 2>, 2> colours{};
  for (const int y : {0, 1}) {
    for (const int x : {0, 1}) {
      if (!alike) colours[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] = bayer_colour(format, x, y);
    }
  }
  for (int y = 0; y < read.rows; ++y) {
    const auto* from = read.ptr<std::uint8_t>(y);
    auto* to = developed.ptr<std::uint8_t>(y);
    const auto& row = colours[static_cast<std::size_t>(y % 2)];
    for (int x = 0; x < read.cols; ++x) to[x] = tables[row[static_cast<std::size_t>(x % 2)]][from[x]];
  }
  return developed;
}

void draw_test_pattern(const std::string& pattern, cv::Mat& image) {
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(pattern == "GreyVerticalRamp" ? y : x);
    }
  }
}

/// Pixels of more than 8 bits are little-endian words with the value in their lower bits.
std::vector<std::uint8_t> pack(const cv::Mat& image, const std::string& format, std::size_t bytes) {
  std::vector<std::uint8_t> packed(bytes);
  const std::size_t pixel = bytes / image.total();
  const int bits = format == "Mono10" ? 10 : format == "Mono12" ? 12 : 16;
  std::size_t at = 0;
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<std::uint8_t>(y);
    if (pixel == 1) {
      std::copy_n(row, image.cols, packed.begin() + static_cast<std::ptrdiff_t>(at));
      at += static_cast<std::size_t>(image.cols);
      continue;
    }
    for (int x = 0; x < image.cols; ++x) {
      const auto word = static_cast<std::uint16_t>(row[x] << (bits - 8));
      for (std::size_t k = 0; k < pixel; ++k) {
        packed[at++] = pixel == 2 ? static_cast<std::uint8_t>(word >> (8 * k)) : row[x];
      }
    }
  }
  return packed;
}

void append_big_endian(std::vector<std::uint8_t>& bytes, std::uint64_t value, int count) {
  for (int shift = 8 * (count - 1); shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

}  // namespace

std::vector<std::uint8_t> develop_gige(const cv::Mat& sensor, const GigeRegisters& registers, double nominal_us,
                                       std::uint64_t stamp_ns) {
  const cv::Mat read = read_sensor(sensor, registers);
  const cv::Rect region({static_cast<int>(registers.number("OffsetX")), static_cast<int>(registers.number("OffsetY"))},
                        registers.frame_size());
  cv::Mat image = develop_tones(read(region), registers, nominal_us);
  if (const std::string pattern = registers.entry("TestPattern"); !pattern.empty() && pattern != "Off") {
    draw_test_pattern(pattern, image);
  }
  const std::size_t size = registers.image_bytes();
  auto bytes = pack(image, registers.entry("PixelFormat"), size);
  if (registers.number("ChunkModeActive") != 0) {  // each chunk is followed by its id and length
    constexpr std::uint64_t kImage = 1, kStamp = 2;
    append_big_endian(bytes, kImage, 4);
    append_big_endian(bytes, size, 4);
    append_big_endian(bytes, stamp_ns, 8);
    append_big_endian(bytes, kStamp, 4);
    append_big_endian(bytes, 8, 4);
  }
  return bytes;
}

void adjust_gige(GigeRegisters& registers, double mean) {
  constexpr double kWanted = 118.0, kSlowest = 0.5, kFastest = 2.0, kRed = 1.6;
  const double change = std::clamp(kWanted / std::max(mean, 1.0), kSlowest, kFastest);
  const auto end_once = [&](const char* name) {
    if (registers.entry(name) == "Once") registers.set(name, 0);
  };
  if (registers.number("ExposureAuto") != 0) {
    registers.set("ExposureTime", std::clamp(registers.number("ExposureTime") * change, 10.0, 1e6));
    end_once("ExposureAuto");
  }
  if (registers.number("GainAuto") != 0) {
    registers.set("Gain", std::clamp(registers.number("Gain") + 20.0 * std::log10(change), 0.0, 24.0));
    end_once("GainAuto");
  }
  if (registers.number("BalanceWhiteAuto") != 0) {
    registers.set("BalanceRatio", kRed, 0);
    end_once("BalanceWhiteAuto");
  }
}

}  // namespace scanrig::sim::wire
