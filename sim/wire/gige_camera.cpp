#include "sim/wire/gige_camera.h"

#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "sim/wire/gige_sensor.h"

namespace scanrig::sim::wire {
namespace {

constexpr std::array<std::pair<std::string_view, GigeFault>, 9> kFaults{{{"none", GigeFault::none},
                                                                         {"lost", GigeFault::lost},
                                                                         {"missed", GigeFault::missed},
                                                                         {"late", GigeFault::late},
                                                                         {"torn", GigeFault::torn},
                                                                         {"stale", GigeFault::stale},
                                                                         {"dark", GigeFault::dark},
                                                                         {"blurred", GigeFault::blurred},
                                                                         {"swapped", GigeFault::swapped}}};

constexpr std::uint64_t kRightState = 1'000'000;  // seed of the right camera's registers beside the left one's

class Pair final : public GigeCameras {
 public:
  Pair(std::unique_ptr<GigeSensor> left, std::unique_ptr<GigeSensor> right, bool is_strobe_wired, Clock& clock)
      : clock_(clock), sensors_{std::move(left), std::move(right)} {
    if (is_strobe_wired) sensors_[0]->on_strobe([this](int output) { return strobe(output); });
  }
  /// The left camera's thread uses the right one.
  ~Pair() override { std::ignore = sensors_[0]->plug(false); }

  std::uint64_t edge(bool pattern) override {
    const std::scoped_lock lock(mutex_);
    const GigeExposure exposure{++edges_, pattern, clock_.now()};
    std::array faults{next_injected(0), next_injected(1)};
    if (const GigeFault chance = draw(); chance != GigeFault::none) faults[random_() % 2] = chance;
    for (std::size_t i = 0; i < sensors_.size(); ++i) sensors_[i]->expose(exposure, faults[i]);
    return exposure.number;
  }
  /// The left camera has been triggered by software while this output is active. Its own frame can be torn or
  /// another image, but not lost or late: it is sent already.
  GigeSensor::Strobe strobe(int output) {
    const std::scoped_lock lock(mutex_);
    const GigeFlash flash{output == 1, clock_.now()};
    flashes_.push_back(flash);
    const GigeExposure exposure{++edges_, flash.pattern, flash.at};
    sensors_[1]->expose(exposure, next_injected(1));
    return {exposure, next_injected(0)};
  }
  std::vector<GigeFlash> flashes() const override {
    const std::scoped_lock lock(mutex_);
    return flashes_;
  }
  bool is_lit() const override {
    std::unique_lock lock(mutex_);
    if (flashes_.empty()) return false;
    const auto [pattern, at] = flashes_.back();
    lock.unlock();
    return sensors_[0]->output() == (pattern ? 1 : 2) && clock_.now() < at + sensors_[0]->exposure_time();
  }
  void inject(Side side, GigeFault fault, int count) override {
    const std::scoped_lock lock(mutex_);
    injected_[index(side)] = {fault, count};
  }
  void happen(const FaultRates& rates) override {
    const std::scoped_lock lock(mutex_);
    rates_ = rates;
    random_.seed(rates.seed);
    counts_ = {};
  }
  FaultCounts happened() const override {
    const std::scoped_lock lock(mutex_);
    return counts_;
  }
  Result<void> plug(Side side, bool in) override { return sensors_[index(side)]->plug(in); }
  void set_clock(Side side, std::chrono::nanoseconds by) override { sensors_[index(side)]->set_clock(by); }
  std::string value(Side side, const std::string& feature) const override {
    return sensors_[index(side)]->value(feature);
  }

 private:
  static std::size_t index(Side side) { return side == Side::left ? 0 : 1; }

  GigeFault next_injected(std::size_t sensor) {
    auto& [fault, count] = injected_[sensor];
    if (count == 0) return GigeFault::none;
    --count;
    return fault;
  }
  GigeFault draw() {
    double chance = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
    const auto falls = [&](double rate, std::uint64_t& count) {
      const bool hit = chance >= 0.0 && chance < rate;
      chance -= rate;
      count += hit;
      return hit;
    };
    if (falls(rates_.lost, counts_.lost)) return GigeFault::lost;
    if (falls(rates_.late, counts_.late)) return GigeFault::late;
    if (falls(rates_.torn, counts_.torn)) return GigeFault::torn;
    if (falls(rates_.stale, counts_.stale)) return GigeFault::stale;
    return GigeFault::none;
  }

  Clock& clock_;
  mutable std::mutex mutex_;
  std::uint64_t edges_ = 0;
  std::array<std::pair<GigeFault, int>, 2> injected_{};
  FaultRates rates_;
  FaultCounts counts_;
  std::mt19937_64 random_{1};
  std::vector<GigeFlash> flashes_;
  std::array<std::unique_ptr<GigeSensor>, 2> sensors_;
};

}  // namespace

std::optional<GigeFault> parse_gige_fault(std::string_view word) {
  for (const auto& [name, fault] : kFaults) {
    if (name == word) return fault;
  }
  return std::nullopt;
}

Result<std::unique_ptr<GigeCameras>> GigeCameras::start(const GigeCamerasOptions& options, FrameSource source,
                                                        Clock& clock) {
  const auto sensor = [&](Side side) {
    GigeSensorOptions own;
    own.side = side;
    own.address = side == Side::left ? options.left_address : options.right_address;
    own.serial = side == Side::left ? options.left_serial : options.right_serial;
    own.model = options.model;
    own.model.sensor = options.size;
    if (own.model.state && side == Side::right) *own.model.state += kRightState;
    own.nominal_exposure = options.nominal_exposure;
    own.late_by = options.late_by;
    own.frame_after = options.frame_after;
    own.ready = options.ready;
    own.numbered = options.numbered;
    // No two crystals agree.
    own.clock_ahead = side == Side::left ? std::chrono::seconds(4711) : std::chrono::seconds(-123);
    own.clock_drift = side == Side::left ? 30e-6 : -40e-6;
    return GigeSensor::start(own, source, clock);
  };
  auto left = sensor(Side::left);
  if (!left) return pass_on(left);
  auto right = sensor(Side::right);
  if (!right) return pass_on(right);
  return std::make_unique<Pair>(std::move(*left), std::move(*right), options.is_strobe_wired, clock);
}

void draw_test_image(Side side, const GigeExposure& exposure, cv::Mat& image) {
  const auto seed = static_cast<std::uint32_t>(exposure.number) * 2654435761u;
  const std::uint32_t shift = side == Side::left ? 0 : 7;
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      const std::uint32_t across = (static_cast<std::uint32_t>(x) + shift) / 2,
                          down = static_cast<std::uint32_t>(y) / 2;
      std::uint32_t grain = across * 73856093u ^ down * 19349663u ^ seed;
      grain = (grain ^ (grain >> 15)) * 2246822519u;
      const std::uint32_t grey = 40 + (grain >> 25);
      row[x] = static_cast<std::uint8_t>(exposure.pattern ? grey : grey / 4);
    }
  }
}

namespace {
constexpr int kBlock = 3, kBitsPerRow = 8;
}  // namespace

void hide_number(std::uint32_t number, cv::Mat& image) {
  for (int bit = 0; bit < 32; ++bit) {
    const cv::Rect block(bit % kBitsPerRow * kBlock, bit / kBitsPerRow * kBlock, kBlock, kBlock);
    image(block).setTo((number >> bit) & 1u ? 230 : 20);
  }
}

std::uint32_t hidden_number(const cv::Mat& image) {
  std::uint32_t number = 0;
  for (int bit = 0; bit < 32; ++bit) {
    const auto grey = image.at<std::uint8_t>(bit / kBitsPerRow * kBlock + 1, bit % kBitsPerRow * kBlock + 1);
    if (grey > 125) number |= 1u << bit;
  }
  return number;
}

}  // namespace scanrig::sim::wire
