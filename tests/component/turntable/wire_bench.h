#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>

#include "drivers/turntable/axis_turntable.h"
#include "sim/wire/simulated_drive.h"
#include "sim/wire/wire_server.h"
#include "tests/component/turntable/turntable_bench.h"

namespace scanrig {

/// A shipped driver against the far end of the wire; a light table, so that real time is short.
class WireBench : public TurntableBench {
 public:
  Turntable& turntable() override { return *table_; }
  Clock& clock() override { return clock_; }
  double seen_deg() override { return drive_->truth().table_deg * (positive_ccw_ ? 1.0 : -1.0); }
  bool seen_moving() override { return drive_->truth().moving; }
  void block(bool blocked) override { drive_->block(blocked); }
  void when_moving(std::function<void()> act) override {
    onlooker_ = std::jthread([this, act = std::move(act)](const std::stop_token& stop) {
      while (!WireBench::seen_moving()) {  // not a virtual call: the table of functions changes on destruction
        if (stop.stop_requested()) return;
        clock_.sleep_for(std::chrono::milliseconds(1));
      }
      act();
    });
  }
  Clock::Duration too_short() override { return std::chrono::milliseconds(60); }
  Degrees tolerance() override { return kTolerance; }

  sim::wire::SimulatedDrive& drive() { return *drive_; }
  sim::wire::WireServer& server() { return *server_; }
  const std::string& device() const { return link_; }

  /// Counts of the driver on its line.
  struct Counted {
    std::uint64_t corrupt = 0, retries = 0;
  };
  virtual Counted counted() const = 0;

 protected:
  /// `name` identifies the end of the line.
  explicit WireBench(const std::string& name)
      : link_(testing::TempDir() + name + std::to_string(::getpid()) + "-" +
              std::to_string(reinterpret_cast<std::uintptr_t>(this))) {}

  /// Sets what all drives have in common.
  template <class Options>
  void lighten(Options& options) const {
    options.scale.gear_ratio = axis_.gear_ratio;
    options.speed = {1800};
    options.acceleration = {20000};
    options.tolerance = kTolerance;
    options.settle = std::chrono::milliseconds(60);
  }
  /// Connects `table` and `server`; returns the table with its own type.
  template <class Table, class Server>
  Table* connect(Result<std::unique_ptr<Table>> table, Result<std::unique_ptr<Server>> server, bool positive_ccw) {
    EXPECT_TRUE(table) << table.error().message;
    EXPECT_TRUE(server) << server.error().message;
    positive_ccw_ = positive_ccw;
    server_ = std::move(*server);
    auto* const as_what_it_is = table->get();
    table_ = std::move(*table);
    return as_what_it_is;
  }

  RealClock clock_;
  const sim::wire::AxisOptions axis_{.gear_ratio = 9, .start_deg = 20};
  const std::string link_;
  std::unique_ptr<sim::wire::SimulatedDrive> drive_;

 private:
  static constexpr Degrees kTolerance{0.05};
  bool positive_ccw_ = true;
  std::unique_ptr<sim::wire::WireServer> server_;
  std::unique_ptr<AxisTurntable> table_;
  std::jthread onlooker_;
};

}  // namespace scanrig
