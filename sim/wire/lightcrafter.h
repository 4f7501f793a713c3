#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "core/clock.h"
#include "sim/wire/lightcrafter_flash.h"

namespace scanrig::sim::wire {

/// A TI DLP LightCrafter 4500 as in its programmer's guide, at the level of HID reports: settings, tables, checks,
/// sequencer, light. Settings are accepted only while it is stopped; only a validated sequence plays.
/// Threads: every function may be called from any thread.
class LightCrafter {
 public:
  using Report = std::array<std::uint8_t, 64>;

  /// One exposure, as seen in front of the projector.
  struct Flash {
    Clock::TimePoint at;
    std::chrono::microseconds exposure{0};
    int image = 0, pattern = 0, depth = 0;
    bool white = false;
    std::array<std::uint8_t, 3> current{};
    bool cut_short = false;
  };
  enum class Fault { none, silent, refuse, earlier_reply, endless_reply };

  explicit LightCrafter(Clock& clock) : clock_(clock), flash_(clock) {}

  void receive(const Report& report);
  /// The next report to send; nothing if there is none yet.
  std::optional<Report> next_report();

  void trigger_in();  ///< an edge at TRIG_IN_1
  /// Called at the rising edge of TRIG_OUT_1, from the thread that calls receive() or trigger_in().
  void on_trigger_out(std::function<void(const Flash&)> listener);
  [[nodiscard]] std::vector<Flash> flashes() const;
  [[nodiscard]] bool lit() const;
  [[nodiscard]] std::vector<Report> received() const;

  void inject(Fault fault, int replies);
  void set_hardware_status(std::uint8_t status);  ///< 0x01: no fault
  void power_cycle();

  /// The firmware is written, checked or damaged here; call with no request under way.
  [[nodiscard]] LightCrafterFlash& flash() { return flash_; }
  /// Counts how often it has come up on USB: an older connection is gone.
  [[nodiscard]] int enumeration() const;

 private:
  struct State {
    std::uint8_t hardware = 0x01;
    bool pattern_mode = false;
    std::uint8_t source = 0, trigger_mode = 0;
    std::uint32_t exposure_us = 0, period_us = 0;
    std::array<std::uint8_t, 4> config{};
    std::array<std::uint8_t, 3> current{0x97, 0x78, 0x7D};
    std::uint8_t open_box = 0, address = 0;
    std::vector<std::uint8_t> patterns, images;
    bool checked = false;
    std::uint8_t check = 0;
    Clock::TimePoint check_ready{};
    bool started = false;
    std::optional<Clock::TimePoint> lit_until;
  };

  void act();
  void restart();
  bool write(std::uint16_t command, const std::vector<std::uint8_t>& data);
  bool write_setting(std::uint16_t command, const std::vector<std::uint8_t>& data);
  std::vector<std::uint8_t> read(std::uint16_t command);
  void check_settings();
  void light_up();
  void settle();
  void reply(std::uint8_t flags, std::uint8_t sequence, const std::vector<std::uint8_t>& data);

  Clock& clock_;
  mutable std::mutex mutex_;
  State state_;
  LightCrafterFlash flash_;
  bool is_programming_ = false;  // its bootloader runs
  int enumeration_ = 0;
  std::vector<std::uint8_t> message_;  // of the reports received so far
  std::deque<Report> outgoing_;
  std::vector<Report> received_;
  std::vector<Flash> flashes_;
  std::function<void(const Flash&)> listener_;
  Fault fault_ = Fault::none;
  int fault_replies_ = 0;
};

}  // namespace scanrig::sim::wire
