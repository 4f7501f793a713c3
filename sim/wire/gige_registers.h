#pragma once

#include <array>
#include <random>
#include <string_view>

#include "core/clock.h"
#include "sim/wire/gige_model.h"

namespace scanrig::sim::wire {

/// Status codes of GigE Vision [GigE Vision 1.2, table 20-1].
enum class GvcpStatus : std::uint16_t {
  success = 0x0000,
  invalid_parameter = 0x8002,
  invalid_address = 0x8003,
  write_protect = 0x8004,
  access_denied = 0x8006,
};

/// Registers of one GigE camera behind its features, with a camera's own rules: what is locked while it acquires or
/// while an automatic has the value, sizes that follow the binning, user sets.
/// Threads: one at a time.
class GigeRegisters {
 public:
  enum class Event { none, acquisition_started, acquisition_stopped, software_trigger };
  struct Written {
    GvcpStatus status = GvcpStatus::success;
    Event event = Event::none;
  };

  GigeRegisters(const GigeModel& model, Clock& clock);

  /// Values after power-on, see GigeModel::state.
  void power_on();
  [[nodiscard]] const std::vector<GigeFeature>& features() const { return features_; }
  [[nodiscard]] std::optional<std::uint32_t> read(std::uint32_t address) const;
  Written write(std::uint32_t address, std::uint32_t value);

  /// Value of a feature by name; what it does when it is switched off if the camera lacks it.
  [[nodiscard]] double number(std::string_view name, std::size_t selected = 0) const;
  [[nodiscard]] std::string entry(std::string_view name, std::size_t selected = 0) const;
  /// Changes a value from within, as an automatic does.
  void set(std::string_view name, double value, std::size_t selected = 0);

  [[nodiscard]] bool is_acquiring() const { return is_acquiring_; }
  void stop_acquiring() { is_acquiring_ = false; }
  /// Size of a frame without chunks; bytes of its pixels, and with chunks.
  [[nodiscard]] cv::Size frame_size() const;
  [[nodiscard]] std::size_t image_bytes() const;
  [[nodiscard]] std::size_t payload_bytes() const;
  /// True once PTP follows the clock of the network.
  [[nodiscard]] bool is_synchronised() const;

 private:
  struct Cell {
    std::size_t feature, selected;
  };
  [[nodiscard]] const GigeFeature* find(std::string_view name) const;
  [[nodiscard]] std::optional<Cell> cell_at(std::uint32_t address) const;
  [[nodiscard]] GvcpStatus check(const GigeFeature& feature, double value, std::size_t selected) const;
  [[nodiscard]] bool is_automatic(const GigeFeature& feature) const;
  [[nodiscard]] double computed(const GigeFeature& feature) const;
  [[nodiscard]] Clock::Duration since_ptp() const;
  Event execute(const GigeFeature& feature);
  void load_standard();
  void draw_state(std::uint64_t seed);
  void fit_sizes();

  const GigeModel model_;
  Clock& clock_;
  const std::vector<GigeFeature> features_;
  std::vector<std::array<double, kGigeWords>> values_;  // by feature, then by the selector's entry
  std::vector<std::array<double, kGigeWords>> user_set_;
  bool is_acquiring_ = false;
  std::optional<Clock::TimePoint> ptp_since_;
};

}  // namespace scanrig::sim::wire
