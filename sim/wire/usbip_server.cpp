#include "sim/wire/usbip_server.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <span>
#include <vector>

namespace scanrig::sim::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kLookMs = 1;  // poll interval for reports of the device
constexpr std::uint16_t kVersion = 0x0111, kImport = 0x8003, kImported = 0x0003;
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;
constexpr std::int32_t kStall = -EPIPE, kUnlinkedInTime = -ECONNRESET;
constexpr std::uint32_t kFullSpeed = 2;

// USB 2.0, chapter 9; HID 1.11, chapter 6.
constexpr std::array<std::uint8_t, 18> kDeviceDescriptor{18,   1,    0x00, 0x02, 0,    0,    0, 64,  // of endpoint 0
                                                         0x51, 0x04, 0x01, 0x64, 0x00, 0x01, 1, 2,  3, 1};
constexpr std::array<std::uint8_t, 29> kReportDescriptor{
    0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01,                                       // a vendor-defined collection
    0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x40,                           // 64 bytes
    0x09, 0x01, 0x81, 0x02, 0x09, 0x01, 0x91, 0x02, 0x09, 0x01, 0xB1, 0x02, 0xC0};  // in, out, feature
constexpr std::array<std::uint8_t, 41> kConfiguration{9,  2,    41,   0,    1,  1,  0,    0xC0,
                                                      50,  //
                                                      9,  4,    0,    0,    2,  3,  0,    0,
                                                      0,  // HID
                                                      9,  0x21, 0x11, 0x01, 0,  1,  0x22, kReportDescriptor.size(),
                                                      0,  7,    5,    0x81, 3,  64, 0,    1,  //
                                                      7,  5,    0x01, 3,    64, 0,  1};

Bytes string_descriptor(std::string_view text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  return bytes;
}

Bytes descriptor(std::uint8_t type, std::uint8_t index) {
  if (type == 1) return {kDeviceDescriptor.begin(), kDeviceDescriptor.end()};
  if (type == 2) return {kConfiguration.begin(), kConfiguration.end()};
  if (type == 0x22) return {kReportDescriptor.begin(), kReportDescriptor.end()};
  if (type != 3) return {};
  if (index == 0) return {4, 3, 0x09, 0x04};
  constexpr std::array<std::string_view, 4> kStrings{"", "Texas Instruments", "DLPC350", "LCR4500-SIM"};
  return index < kStrings.size() ? string_descriptor(kStrings[index]) : Bytes{};
}

/// Numbers on the wire are big-endian.
class Writer {
 public:
  Writer& u32(std::uint32_t value) { return u16(value >> 16).u16(value & 0xFFFF); }
  Writer& u16(std::uint32_t value) {
    bytes_.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Writer& u8(std::uint32_t value) { return bytes_.push_back(static_cast<std::uint8_t>(value)), *this; }
  Writer& text(std::string_view text, std::size_t length) {
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.resize(bytes_.size() + length - text.size());
    return *this;
  }
  Writer& add(const Bytes& more) { return bytes_.insert(bytes_.end(), more.begin(), more.end()), *this; }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

/// One kernel's connection, from the import of the device to the end.
class Session {
 public:
  Session(int socket, LightCrafter& device) : socket_(socket), device_(device) {}

  /// Until the kernel hangs up, or `stop`.
  void run(const std::stop_token& stop) {
    if (!import()) return;
    while (!stop.stop_requested()) {
      pollfd watched{socket_, POLLIN, 0};
      if (::poll(&watched, 1, kLookMs) > 0 && !take_command()) return;
      if (!send_reports()) return;
    }
  }

 private:
  static std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
    return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 | std::uint32_t{bytes[at + 2]} << 8 |
           bytes[at + 3];
  }

  bool read(std::span<std::uint8_t> bytes) {
    return bytes.empty() ||
           ::recv(socket_, bytes.data(), bytes.size(), MSG_WAITALL) == static_cast<ssize_t>(bytes.size());
  }
  bool write(const Bytes& bytes) {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }

  bool import() {
    std::array<std::uint8_t, 40> request{};
    if (!read(request) || (request[2] << 8 | request[3]) != kImport) return false;
    Writer reply;
    reply.u16(kVersion).u16(kImported).u32(0);
    reply.text("/sys/devices/simulated/usb1/1-1", 256).text(UsbIpServer::kBusId, 32);
    reply.u32(1).u32(1).u32(kFullSpeed).u16(0x0451).u16(0x6401).u16(0x0100);
    for (const int byte : {0, 0, 0, 1, 1, 1}) reply.u8(static_cast<std::uint32_t>(byte));
    return write(reply.bytes());
  }

  bool take_command() {
    std::array<std::uint8_t, 48> header{};
    if (!read(header)) return false;
    const std::uint32_t number = word(header, 4);
    if (word(header, 0) == kUnlink) return unlink(number, word(header, 20));
    if (word(header, 0) != kSubmit) return false;
    const bool in = word(header, 12) == 1;
    const std::uint32_t endpoint = word(header, 16), length = word(header, 24);
    Bytes data(in ? 0 : std::min<std::uint32_t>(length, 65536));
    if (!read(data)) return false;
    if (endpoint == 0) return control({header.begin() + 40, header.end()}, number, length);
    if (in) {
      waiting_.push_back(number);
      return true;
    }
    LightCrafter::Report report{};
    std::copy_n(data.begin(), std::min(data.size(), report.size()), report.begin());
    device_.receive(report);
    return send_reply(number, 0, static_cast<std::uint32_t>(data.size()), {});
  }

  /// Requests to endpoint 0: descriptors are sent, settings of USB and HID accepted.
  bool control(const Bytes& setup, std::uint32_t number, std::uint32_t length) {
    constexpr std::uint8_t kGetDescriptor = 6;
    const bool in = setup[0] & 0x80;
    if (!in) return send_reply(number, 0, length, {});
    if (setup[1] != kGetDescriptor) return send_reply(number, 0, 0, Bytes(std::min<std::uint32_t>(length, 2)));
    Bytes found = descriptor(setup[3], setup[2]);
    if (found.empty()) return send_reply(number, kStall, 0, {});
    found.resize(std::min<std::size_t>(found.size(), length));
    return send_reply(number, 0, 0, found);
  }

  bool unlink(std::uint32_t number, std::uint32_t unlinked) {
    const bool waited = std::erase(waiting_, unlinked) > 0;
    Writer reply;
    reply.u32(kUnlinked).u32(number).u32(0).u32(0).u32(0);
    reply.u32(static_cast<std::uint32_t>(waited ? kUnlinkedInTime : 0)).text("", 24);
    return write(reply.bytes());
  }

  bool send_reports() {
    while (!waiting_.empty()) {
      const auto report = device_.next_report();
      if (!report) return true;
      if (!send_reply(waiting_.front(), 0, 0, {report->begin(), report->end()})) return false;
      waiting_.pop_front();
    }
    return true;
  }

  /// `taken`: bytes given to the device; or `data` from it.
  bool send_reply(std::uint32_t number, std::int32_t status, std::uint32_t taken, const Bytes& data) {
    Writer reply;
    reply.u32(kSubmitted).u32(number).u32(0).u32(0).u32(0);
    reply.u32(static_cast<std::uint32_t>(status)).u32(data.empty() ? taken : static_cast<std::uint32_t>(data.size()));
    reply.u32(0).u32(0).u32(0).text("", 8).add(data);
    return write(reply.bytes());
  }

  const int socket_;
  LightCrafter& device_;
  std::deque<std::uint32_t> waiting_;  // numbers of interrupt transfers that wait for a report
};

}  // namespace

Result<std::unique_ptr<UsbIpServer>> UsbIpServer::start(std::uint16_t port, LightCrafter& device) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener, 1) != 0) {
    const int reason = errno;
    ::close(listener);
    return fail(ErrorCode::io, "usbip: port {}: {}", port, std::strerror(reason));
  }
  return std::unique_ptr<UsbIpServer>(new UsbIpServer(listener, device));
}

UsbIpServer::UsbIpServer(int listener, LightCrafter& device)
    : listener_(listener), device_(device), thread_([this](const std::stop_token& stop) { serve(stop); }) {}

UsbIpServer::~UsbIpServer() {
  thread_.request_stop();
  ::shutdown(listener_, SHUT_RDWR);
  thread_.join();
  ::close(listener_);
}

void UsbIpServer::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) continue;
    const int yes = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    const timeval limit{2, 0};  // for the rest of a command that has started
    ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    Session(socket, device_).run(stop);
    ::close(socket);
  }
}

}  // namespace scanrig::sim::wire
