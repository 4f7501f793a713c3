#include "drivers/serial/line_options.h"

#include <gmock/gmock.h>
#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

namespace scanrig::serial {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// The kernel's driver of a port with RS-485 and a latency that can be set.
struct ScriptedPort {
  serial_rs485 direction{};
  std::uint32_t longest_delay_ms = 100;
  bool has_only_low = false;
  int refuses = 0;  ///< errno of every request
  unsigned flags = 0;

  PortControl control() {
    return [this](int, unsigned long request, void* argument) {
      if (refuses != 0) {
        errno = refuses;
        return -1;
      }
      if (request == TIOCSRS485) {
        direction = *static_cast<serial_rs485*>(argument);
        direction.delay_rts_before_send = std::min(direction.delay_rts_before_send, longest_delay_ms);
        if (has_only_low) direction.flags = SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND;
      }
      if (request == TIOCGRS485) *static_cast<serial_rs485*>(argument) = direction;
      if (request == TIOCGSERIAL) static_cast<serial_struct*>(argument)->flags = static_cast<int>(flags);
      if (request == TIOCSSERIAL) flags = static_cast<unsigned>(static_cast<serial_struct*>(argument)->flags);
      return 0;
    };
  }
};

TEST(Rs485Direction, LevelAndDelaysAreTheKernels) {
  ScriptedPort port;
  ASSERT_TRUE(use_rs485(3, {true, milliseconds(2), milliseconds(5)}, port.control()));
  EXPECT_EQ(port.direction.flags, std::uint32_t{SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND});
  EXPECT_EQ(port.direction.delay_rts_before_send, 2u);
  EXPECT_EQ(port.direction.delay_rts_after_send, 5u);
  ASSERT_TRUE(use_rs485(3, {false, milliseconds(0), milliseconds(0)}, port.control()));
  EXPECT_EQ(port.direction.flags, std::uint32_t{SER_RS485_ENABLED | SER_RS485_RTS_AFTER_SEND});
}

TEST(Rs485Direction, APortWithoutItIsUnsupportedWithTheRemedy) {
  ScriptedPort port;
  port.refuses = ENOTTY;
  const auto used = use_rs485(3, {}, port.control());
  ASSERT_FALSE(used);
  EXPECT_EQ(used.error().code, ErrorCode::unsupported);
  EXPECT_THAT(used.error().message, HasSubstr("does not switch the direction of RS-485"));
  EXPECT_THAT(used.error().message, HasSubstr("leave rs485 out"));
  port.refuses = EIO;
  EXPECT_EQ(use_rs485(3, {}, port.control()).error().code, ErrorCode::io);
}

TEST(Rs485Direction, OtherValuesThanAskedForAreNamed) {
  ScriptedPort port;
  port.longest_delay_ms = 1;
  const auto delay = use_rs485(3, {true, milliseconds(20), milliseconds(0)}, port.control());
  ASSERT_FALSE(delay);
  EXPECT_EQ(delay.error().code, ErrorCode::unsupported);
  EXPECT_THAT(delay.error().message, HasSubstr("RTS high while sending, 1 ms before, 0 ms after"));
  port.has_only_low = true;
  const auto level = use_rs485(3, {}, port.control());
  ASSERT_FALSE(level);
  EXPECT_THAT(level.error().message, HasSubstr("RTS low while sending"));
}

class Latency : public testing::Test {
 protected:
  Latency() { std::filesystem::create_directories(timer_.parent_path()); }
  ~Latency() override { std::filesystem::remove_all(root_); }

  std::optional<std::string> ask(ScriptedPort& port) {
    return request_low_latency(3, "/dev/ttyUSB7", port.control(), root_.string());
  }

  const std::filesystem::path root_ =
      std::filesystem::path(testing::TempDir()) / ("latency" + std::to_string(::getpid()));
  const std::filesystem::path timer_ = root_ / "sys/bus/usb-serial/devices/ttyUSB7/latency_timer";
};

TEST_F(Latency, IsAskedForWithoutOtherChanges) {
  ScriptedPort port;
  port.flags = ASYNC_SPD_HI;
  EXPECT_FALSE(ask(port)) << "an adapter without a timer";
  EXPECT_EQ(port.flags, ASYNC_SPD_HI | ASYNC_LOW_LATENCY);
}

TEST_F(Latency, AnAdapterThatStillWaitsIsNamed) {
  ScriptedPort port;
  std::ofstream(timer_) << "16\n";
  EXPECT_THAT(ask(port).value_or(""), HasSubstr("passes bytes on after 16 ms only: install the package's rules"));
  std::ofstream(timer_) << "1\n";
  EXPECT_FALSE(ask(port));
}

TEST_F(Latency, APortThatHasNoSuchSettingIsLeftAsItIs) {
  ScriptedPort port;
  port.refuses = ENOTTY;
  EXPECT_FALSE(ask(port));
  EXPECT_EQ(port.flags, 0u);
}

}  // namespace
}  // namespace scanrig::serial
