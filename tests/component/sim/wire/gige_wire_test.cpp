#include "sim/wire/gige_wire.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace scanrig::sim::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kReadRegister = 0x80, kWriteRegister = 0x82, kReadMemory = 0x84;
constexpr std::uint32_t kHeartbeat = 0x0938, kPrivilege = 0x0A00, kPacketSize = 0x0D04, kXml = 0x100000;
constexpr std::uint32_t kOwn = 0x20000;  // a register of the device itself

/// A host that speaks the control protocol by hand [GigE Vision 1.2, 15 to 18].
class Host {
 public:
  Host() : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in camera{};
    camera.sin_family = AF_INET;
    camera.sin_port = htons(3956);
    ::inet_pton(AF_INET, "127.0.0.1", &camera.sin_addr);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&camera), sizeof camera), 0);
  }
  ~Host() { ::close(socket_); }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// The whole reply; empty: none came.
  Bytes ask(std::uint16_t command, const Bytes& payload) {
    Bytes packet{0x42,
                 0x01,
                 static_cast<std::uint8_t>(command >> 8),
                 static_cast<std::uint8_t>(command),
                 0,
                 static_cast<std::uint8_t>(payload.size()),
                 0,
                 ++id_};
    packet.insert(packet.end(), payload.begin(), payload.end());
    EXPECT_GT(::send(socket_, packet.data(), packet.size(), 0), 0);
    pollfd watched{socket_, POLLIN, 0};
    if (::poll(&watched, 1, 2000) <= 0) return {};
    Bytes reply(2048);
    reply.resize(static_cast<std::size_t>(std::max<ssize_t>(0, ::recv(socket_, reply.data(), reply.size(), 0))));
    EXPECT_TRUE(reply.size() < 8 || reply[7] == id_);
    return reply;
  }
  int write(std::uint32_t address, std::uint32_t value) {
    Bytes payload = words({address, value});
    return status(ask(kWriteRegister, payload));
  }
  static int status(const Bytes& reply) { return reply.size() < 8 ? -1 : reply[0] * 256 + reply[1]; }
  static Bytes words(const std::vector<std::uint32_t>& words) {
    Bytes bytes;
    for (const auto word : words) {
      for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
    }
    return bytes;
  }

 private:
  int socket_;
  std::uint8_t id_ = 0;
};

class GigeWireTest : public testing::Test {
 protected:
  void SetUp() override {
    GigeWire::Handlers handlers;
    handlers.read = [](std::uint32_t address) { return address == kOwn ? std::optional(0x01020304u) : std::nullopt; };
    handlers.write = [](std::uint32_t, std::uint32_t value) {
      return value == 13 ? GvcpStatus::access_denied : GvcpStatus::success;
    };
    handlers.is_acquiring = [this] { return is_acquiring_.load(); };
    handlers.on_abandoned = [this] { ++abandoned_; };
    GigeWireOptions options;
    options.address = "127.0.0.1";
    options.serial = "77";
    options.description = "<?xml twin";
    auto wire = GigeWire::open(options, handlers, clock_);
    ASSERT_TRUE(wire) << wire.error().message;
    wire_ = std::move(*wire);
  }

  RealClock clock_;
  std::atomic<bool> is_acquiring_ = false;
  std::atomic<int> abandoned_ = 0;
  std::unique_ptr<GigeWire> wire_;
  Host host_, other_;
};

TEST_F(GigeWireTest, ReportsItselfAndItsDescriptionToAnyHost) {
  const auto found = host_.ask(0x0002, {});
  ASSERT_EQ(found.size(), 8u + 248u);
  EXPECT_EQ(std::string(found.begin() + 8 + 0xD8, found.begin() + 8 + 0xDA), "77");
  const auto text = host_.ask(kReadMemory, Host::words({kXml, 8}));
  ASSERT_EQ(text.size(), 8u + 4u + 8u);
  EXPECT_EQ(std::string(text.begin() + 12, text.end()), "<?xml tw");
  const auto own = host_.ask(kReadRegister, Host::words({kOwn}));
  EXPECT_EQ(Bytes(own.begin() + 8, own.end()), (Bytes{1, 2, 3, 4}));
  EXPECT_EQ(Host::status(host_.ask(kReadRegister, Host::words({0x90000}))), 0x8003);
}

TEST_F(GigeWireTest, ObeysOnlyTheHostThatControlsIt) {
  EXPECT_EQ(host_.write(kOwn, 1), 0x8006);
  ASSERT_EQ(host_.write(kPrivilege, 2), 0);
  EXPECT_EQ(host_.write(kOwn, 1), 0);
  EXPECT_EQ(host_.write(kOwn, 13), 0x8006) << "its device refuses";
  EXPECT_EQ(other_.write(kOwn, 1), 0x8006);
  EXPECT_EQ(other_.write(kPrivilege, 2), 0x8006);
  ASSERT_EQ(host_.write(kPrivilege, 0), 0);
  EXPECT_EQ(abandoned_, 1);
  EXPECT_EQ(other_.write(kPrivilege, 2), 0);
}

TEST_F(GigeWireTest, AHostThatIsSilentLosesControl) {
  ASSERT_EQ(host_.write(kPrivilege, 2), 0);
  ASSERT_EQ(host_.write(kHeartbeat, 150), 0);
  const auto end = Deadline::after(clock_, std::chrono::seconds(5));
  while (other_.write(kPrivilege, 2) != 0 && !end.expired(clock_)) clock_.sleep_for(std::chrono::milliseconds(60));
  EXPECT_EQ(abandoned_, 1);
  EXPECT_EQ(host_.write(kOwn, 1), 0x8006);
}

TEST_F(GigeWireTest, PacketsKeepTheirSizeWhileItAcquires) {
  ASSERT_EQ(host_.write(kPrivilege, 2), 0);
  EXPECT_EQ(host_.write(kPacketSize, 1500), 0);
  is_acquiring_ = true;
  EXPECT_EQ(host_.write(kPacketSize, 9000), 0x8006);
  EXPECT_EQ(host_.write(0x0000, 1), 0x8004);
}

TEST_F(GigeWireTest, WhatIsNoRequestIsIgnored) {
  EXPECT_TRUE(host_.ask(0x1234, {}).empty());
  EXPECT_FALSE(host_.ask(0x0002, {}).empty());
}

TEST_F(GigeWireTest, AnAddressInUseIsNamed) {
  GigeWireOptions same;
  same.address = "127.0.0.1";
  const auto second = GigeWire::open(same, {}, clock_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig::sim::wire
