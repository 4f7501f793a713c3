#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include "drivers/gpio/lines.h"
#include "sim/wire/gpio_socket.h"

namespace scanrig {

/// Lines behind a socket: the test reads outputs and sets inputs of the drivers.
class GpioBench : public testing::Test {
 protected:
  RealClock clock_;
  const std::string path_ = testing::TempDir() + "gpio" + std::to_string(::getpid()) + ".sock";
  std::unique_ptr<sim::wire::GpioSocket> far_end_;
  std::unique_ptr<gpio::Lines> lines_ = gpio::socket_lines(path_, clock_);

  void start(std::map<std::string, bool> levels) {
    auto started = sim::wire::GpioSocket::start(path_, std::move(levels), clock_);
    ASSERT_TRUE(started) << started.error().message;
    far_end_ = std::move(*started);
  }
  Deadline within(int ms) { return Deadline::after(clock_, std::chrono::milliseconds(ms)); }
};

}  // namespace scanrig
