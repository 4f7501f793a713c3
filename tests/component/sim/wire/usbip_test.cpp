// The LightCrafter on its USB/IP cable, with the requests of Linux' vhci-hcd.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <optional>
#include <string>
#include <vector>

#include "sim/wire/usbip_server.h"

namespace scanrig::sim::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ::testing::ElementsAre;

/// Returns a free port.
std::uint16_t free_port() {
  const int probe = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  ::bind(probe, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(probe);
  return ntohs(address.sin_port);
}

const std::uint16_t kPort = free_port();

void add(Bytes& bytes, std::uint32_t word) {
  for (const int shift : {24, 16, 8, 0}) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
}

std::uint32_t word(const Bytes& bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 | std::uint32_t{bytes[at + 2]} << 8 |
         bytes[at + 3];
}

/// The kernel's end of the cable.
class Host {
 public:
  Host() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit{5, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(kPort);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Host() { ::close(socket_); }

  Bytes import() {
    Bytes request{0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0};
    const std::string bus = UsbIpServer::kBusId;
    request.insert(request.end(), bus.begin(), bus.end());
    request.resize(40);
    send(request);
    return receive(8 + 312);
  }

  void submit(std::uint32_t number, bool in, std::uint32_t endpoint, std::uint32_t length, const Bytes& setup,
              const Bytes& data = {}) {
    Bytes request;
    for (const std::uint32_t part : {1u, number, 0x00010001u, std::uint32_t{in}, endpoint, 0u, length, 0u, 0u, 0u}) {
      add(request, part);
    }
    request.insert(request.end(), setup.begin(), setup.end());
    request.resize(48);
    request.insert(request.end(), data.begin(), data.end());
    send(request);
  }

  void unlink(std::uint32_t number, std::uint32_t unlinked) {
    Bytes request;
    for (const std::uint32_t part : {2u, number, 0x00010001u, 0u, 0u, unlinked}) add(request, part);
    request.resize(48);
    send(request);
  }

  /// The header of the next reply.
  Bytes header() { return receive(48); }

  void send(const Bytes& bytes) {
    EXPECT_EQ(::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  /// Reads this many bytes; fewer when the other end hung up.
  Bytes receive(std::size_t count) {
    Bytes bytes(count);
    const auto size = ::recv(socket_, bytes.data(), count, MSG_WAITALL);
    bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return bytes;
  }

 private:
  int socket_;
};

class UsbIp : public ::testing::Test {
 protected:
  void SetUp() override {
    auto server = UsbIpServer::start(kPort, device_);
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }

  RealClock clock_;
  LightCrafter device_{clock_};
  std::unique_ptr<UsbIpServer> server_;
};

TEST_F(UsbIp, TheDeviceIsImportedByItsBusIdAsALightCrafter) {
  Host host;
  const Bytes reply = host.import();
  ASSERT_EQ(reply.size(), 320u);
  EXPECT_EQ(word(reply, 0), 0x01110003u);
  EXPECT_EQ(word(reply, 4), 0u);  // success
  EXPECT_EQ(word(reply, 8 + 256 + 32 + 12), 0x04516401u);
}

TEST_F(UsbIp, ItsDeviceDescriptorIsSentUpToTheRequestedLength) {
  Host host;
  host.import();
  host.submit(7, true, 0, 8, {0x80, 6, 0, 1, 0, 0, 8, 0});
  const Bytes header = host.header();
  EXPECT_EQ(word(header, 0), 3u);
  EXPECT_EQ(word(header, 4), 7u);
  EXPECT_EQ(word(header, 20), 0u);
  ASSERT_EQ(word(header, 24), 8u);
  EXPECT_THAT(host.receive(8), ElementsAre(18, 1, 0x00, 0x02, 0, 0, 0, 64));
}

TEST_F(UsbIp, AMissingDescriptorStalls) {
  Host host;
  host.import();
  host.submit(1, true, 0, 10, {0x80, 6, 0, 6, 0, 0, 10, 0});
  EXPECT_EQ(static_cast<std::int32_t>(word(host.header(), 20)), -EPIPE);
}

TEST_F(UsbIp, AReadWaitsUntilTheDeviceHasAReport) {
  Host host;
  host.import();
  host.submit(1, true, 1, 64, {});
  // "Read the status" [DLPC350 Programmer's Guide 2.1]: a read, with a reply, of command 0x1A0A.
  Bytes report{0xC0, 0x11, 2, 0, 0x0A, 0x1A};
  report.resize(64);
  host.submit(2, false, 1, 64, {}, report);
  const Bytes taken = host.header();
  EXPECT_EQ(word(taken, 4), 2u);
  EXPECT_EQ(word(taken, 24), 64u);
  const Bytes header = host.header();
  EXPECT_EQ(word(header, 4), 1u);
  ASSERT_EQ(word(header, 24), 64u);
  EXPECT_EQ(host.receive(64)[1], 0x11);  // the reply has the request's sequence number
}

TEST_F(UsbIp, ACancelledReadGetsNoLaterReply) {
  Host host;
  host.import();
  host.submit(1, true, 1, 64, {});
  host.unlink(2, 1);
  const Bytes unlinked = host.header();
  EXPECT_EQ(word(unlinked, 0), 4u);
  EXPECT_EQ(static_cast<std::int32_t>(word(unlinked, 20)), -ECONNRESET);
}

TEST_F(UsbIp, AnotherKernelCanHaveItAfterTheFirstHungUp) {
  {
    Host first;
    first.import();
  }
  Host second;
  EXPECT_EQ(second.import().size(), 320u);
}

TEST_F(UsbIp, AClientThatDoesNotImportTheDeviceIsDisconnected) {
  Host host;
  host.send(Bytes(40, 0xFF));
  EXPECT_TRUE(host.receive(1).empty());
}

TEST_F(UsbIp, APortThatIsTakenIsAnError) { EXPECT_EQ(UsbIpServer::start(kPort, device_).error().code, ErrorCode::io); }

}  // namespace
}  // namespace scanrig::sim::wire
