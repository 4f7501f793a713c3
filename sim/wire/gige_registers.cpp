#include "sim/wire/gige_registers.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace scanrig::sim::wire {
namespace {

using Kind = GigeFeature::Kind;
using Status = GvcpStatus;

constexpr std::size_t kChunkBytes = 8 + 8 + 8;  // trailer of the image; a time stamp and its trailer
constexpr auto kListening = std::chrono::milliseconds(100), kUncalibrated = std::chrono::milliseconds(1000);

std::uint32_t coded(const GigeFeature& feature, double value) {
  if (feature.kind == Kind::real) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

double decoded(const GigeFeature& feature, std::uint32_t word) {
  if (feature.kind == Kind::real) return static_cast<double>(std::bit_cast<float>(word));
  return feature.entries.empty() ? static_cast<double>(static_cast<std::int32_t>(word)) : static_cast<double>(word);
}

double whole(double value, double of) { return std::floor(value / of); }

}  // namespace

GigeRegisters::GigeRegisters(const GigeModel& model, Clock& clock)
    : model_(model), clock_(clock), features_(gige_features(model)), values_(features_.size()) {
  power_on();
}

void GigeRegisters::power_on() {
  is_acquiring_ = false;
  ptp_since_.reset();
  load_standard();
  if (model_.state) draw_state(*model_.state);
  user_set_ = values_;
}

void GigeRegisters::load_standard() {
  for (std::size_t i = 0; i < features_.size(); ++i) values_[i].fill(features_[i].standard);
}

/// Any state that a program can have left: four values of five are drawn, and half of the cameras acquire.
void GigeRegisters::draw_state(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto share = [&] { return std::uniform_real_distribution<double>(0.0, 1.0)(random); };
  constexpr double kKept = 0.2;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const GigeFeature& feature = features_[i];
    if (feature.kind == Kind::command || feature.kind == Kind::computed || feature.name == "PtpEnable") continue;
    for (double& value : values_[i]) {
      const double kept = share(), at = share();
      if (kept < kKept) continue;
      if (!feature.entries.empty()) {
        const auto entry = static_cast<std::size_t>(at * static_cast<double>(feature.entries.size()));
        value = feature.entries[entry].second;
      } else {
        value = feature.low + at * (feature.high - feature.low);
        if (feature.kind != Kind::real) value = std::round(value);
      }
    }
  }
  fit_sizes();
  is_acquiring_ = share() < 0.5;
}

/// A size cannot exceed what binning and decimation leave of the sensor.
void GigeRegisters::fit_sizes() {
  for (const auto& [size, offset] : {std::pair("Width", "OffsetX"), std::pair("Height", "OffsetY")}) {
    const double largest = number(size == std::string_view("Width") ? "WidthMax" : "HeightMax");
    set(offset, std::clamp(number(offset), 0.0, std::max(0.0, largest - 16)));
    set(size, std::clamp(number(size), 16.0, largest - number(offset)));
  }
}

const GigeFeature* GigeRegisters::find(std::string_view name) const {
  const auto found = std::ranges::find(features_, name, &GigeFeature::name);
  return found == features_.end() ? nullptr : &*found;
}

double GigeRegisters::number(std::string_view name, std::size_t selected) const {
  const GigeFeature* feature = find(name);
  if (!feature) {
    const bool factor =
        name == "Gamma" || name == "BalanceRatio" || name.starts_with("Binning") || name.starts_with("Decimation");
    return factor ? 1.0 : 0.0;
  }
  if (feature->kind == Kind::computed) return computed(*feature);
  return values_[static_cast<std::size_t>(feature - features_.data())][selected];
}

std::string GigeRegisters::entry(std::string_view name, std::size_t selected) const {
  const GigeFeature* feature = find(name);
  if (!feature) return {};
  const auto value = static_cast<std::uint32_t>(number(name, selected));
  const auto found = std::ranges::find(feature->entries, value, &std::pair<std::string, std::uint32_t>::second);
  return found == feature->entries.end() ? "" : found->first;
}

void GigeRegisters::set(std::string_view name, double value, std::size_t selected) {
  if (const GigeFeature* feature = find(name)) {
    values_[static_cast<std::size_t>(feature - features_.data())][selected] = value;
  }
}

double GigeRegisters::computed(const GigeFeature& feature) const {
  const std::string& name = feature.name;
  if (name == "WidthMax") {
    return whole(whole(model_.sensor.width, number("BinningHorizontal")), number("DecimationHorizontal"));
  }
  if (name == "HeightMax") {
    return whole(whole(model_.sensor.height, number("BinningVertical")), number("DecimationVertical"));
  }
  if (name == "OffsetXMax") return number("WidthMax") - number("Width");
  if (name == "OffsetYMax") return number("HeightMax") - number("Height");
  if (name == "PayloadSize") return static_cast<double>(payload_bytes());
  if (name == "PtpOffsetFromMaster") {
    constexpr double kFirst = 1e6, kWide = 2e6;  // ns
    const auto halvings = std::chrono::duration<double, std::milli>(since_ptp()).count() / 20.0;
    return model_.ptp == GigeModel::Ptp::wide ? kWide : std::round(kFirst * std::exp2(-halvings));
  }
  constexpr double kDisabled = 2, kIsListening = 3, kIsUncalibrated = 7, kSlave = 8;  // PtpStatus
  if (!ptp_since_) return kDisabled;
  if (since_ptp() < kListening || model_.ptp == GigeModel::Ptp::never) return kIsListening;
  return is_synchronised() ? kSlave : kIsUncalibrated;
}

Clock::Duration GigeRegisters::since_ptp() const {
  return ptp_since_ ? clock_.now() - *ptp_since_ : Clock::Duration{0};
}

bool GigeRegisters::is_synchronised() const {
  return ptp_since_ && model_.ptp != GigeModel::Ptp::never && since_ptp() >= kUncalibrated;
}

cv::Size GigeRegisters::frame_size() const {
  return {static_cast<int>(number("Width")), static_cast<int>(number("Height"))};
}

std::size_t GigeRegisters::image_bytes() const {
  const auto bits = (static_cast<std::uint32_t>(number("PixelFormat")) >> 16) & 0xff;
  return static_cast<std::size_t>(frame_size().area()) * bits / 8;
}

std::size_t GigeRegisters::payload_bytes() const {
  return image_bytes() + (number("ChunkModeActive") != 0 ? kChunkBytes : 0);
}

std::optional<GigeRegisters::Cell> GigeRegisters::cell_at(std::uint32_t address) const {
  if (address < kGigeFirstAddress || address % 4 != 0) return std::nullopt;
  const std::uint32_t word = (address - kGigeFirstAddress) / 4;
  if (word / kGigeWords >= features_.size()) return std::nullopt;
  return Cell{word / kGigeWords, word % kGigeWords};
}

std::optional<std::uint32_t> GigeRegisters::read(std::uint32_t address) const {
  const auto cell = cell_at(address);
  if (!cell) return std::nullopt;
  const GigeFeature& feature = features_[cell->feature];
  if (feature.kind == Kind::command) return 0;  // done
  return coded(feature, feature.kind == Kind::computed ? computed(feature) : values_[cell->feature][cell->selected]);
}

/// True if an automatic has the value: the camera then refuses the host's.
bool GigeRegisters::is_automatic(const GigeFeature& feature) const {
  const auto on = [&](const char* name) { return number(name) != 0; };
  if (feature.name == "ExposureTime") return on("ExposureAuto");
  if (feature.name == "Gain") return on("GainAuto");
  return feature.name == "BalanceRatio" && on("BalanceWhiteAuto");
}

GvcpStatus GigeRegisters::check(const GigeFeature& feature, double value, std::size_t selected) const {
  if (feature.kind == Kind::computed) return Status::write_protect;
  if ((feature.is_locked && is_acquiring_) || is_automatic(feature)) return Status::access_denied;
  if (selected > 0 && feature.selector.empty()) return Status::invalid_address;
  if (!feature.entries.empty()) {
    const auto word = static_cast<std::uint32_t>(value);
    const bool known = std::ranges::any_of(feature.entries, [&](const auto& entry) { return entry.second == word; });
    return known ? Status::success : Status::invalid_parameter;
  }
  const double high = feature.limit.empty() ? feature.high : number(feature.limit);
  const bool inside = value >= feature.low && value <= high;
  const bool too_wide = (feature.name == "Width" && value + number("OffsetX") > high) ||
                        (feature.name == "Height" && value + number("OffsetY") > high);
  return inside && !too_wide ? Status::success : Status::invalid_parameter;
}

GigeRegisters::Written GigeRegisters::write(std::uint32_t address, std::uint32_t word) {
  const auto cell = cell_at(address);
  if (!cell) return {Status::invalid_address};
  const GigeFeature& feature = features_[cell->feature];
  double value = decoded(feature, word);
  if (const Status status = check(feature, value, cell->selected); status != Status::success) return {status};
  if (feature.kind == Kind::command) return {Status::success, execute(feature)};
  if (std::ranges::find(model_.stuck, feature.name) != model_.stuck.end()) return {};
  if (feature.name == "ExposureTime" && model_.max_exposure_us > 0) {
    value = std::min<double>(value, model_.max_exposure_us);
  }
  values_[cell->feature][cell->selected] = value;
  if (feature.name.starts_with("Binning") || feature.name.starts_with("Decimation")) fit_sizes();
  if (feature.name == "PtpEnable") {
    if (value == 0) ptp_since_.reset();
    if (value != 0 && !ptp_since_) ptp_since_ = clock_.now();
  }
  return {};
}

GigeRegisters::Event GigeRegisters::execute(const GigeFeature& feature) {
  if (feature.name == "AcquisitionStart") {
    is_acquiring_ = true;
    return Event::acquisition_started;
  }
  if (feature.name == "AcquisitionStop") {
    is_acquiring_ = false;
    return Event::acquisition_stopped;
  }
  if (feature.name == "TriggerSoftware") return Event::software_trigger;
  if (feature.name == "UserSetLoad") {
    const bool standard = entry("UserSetSelector") == "Default";
    ptp_since_.reset();
    if (standard) {
      load_standard();
    } else {
      values_ = user_set_;
    }
  }
  return Event::none;
}

}  // namespace scanrig::sim::wire
