#pragma once

#include "drivers/turntable/grbl_turntable.h"
#include "sim/wire/grbl_server.h"
#include "tests/component/turntable/wire_bench.h"

namespace scanrig {

class GrblBench : public WireBench {
 public:
  using Change = std::function<void(GrblTurntableOptions&, sim::wire::GrblSettings&)>;

  explicit GrblBench(const Change& change = [](auto&, auto&) {}) : WireBench("grbl") {
    sim::wire::GrblSettings settings{.homing_deg_s = 400, .acceleration_deg_s2 = 20000};
    GrblTurntableOptions options;
    lighten(options);
    options.drive.link.device = link_;
    options.drive.link.reply_timeout = std::chrono::milliseconds(30);
    change(options, settings);
    auto controller = std::make_unique<sim::wire::GrblController>(axis_, settings, clock_);
    auto server = sim::wire::GrblServer::start(link_, *controller, clock_);
    drive_ = std::move(controller);
    table_ = connect(GrblTurntable::create(options, clock_), std::move(server), options.scale.positive_ccw);
  }

  bool has_feedback() override { return false; }
  Counted counted() const override { return {table_->statistics().corrupt, table_->statistics().retries}; }

 private:
  GrblTurntable* table_ = nullptr;
};

}  // namespace scanrig
