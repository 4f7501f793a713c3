#include "sim/wire/gige_wire.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace scanrig::sim::wire {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr std::uint8_t kKey = 0x42;  // of every request [GigE Vision 1.2, 15.1]
constexpr std::uint16_t kDiscovery = 0x0002, kReadRegister = 0x0080, kWriteRegister = 0x0082, kReadMemory = 0x0084,
                        kWriteMemory = 0x0086;
constexpr std::size_t kHeader = 8, kMaxRead = 536;

// Bootstrap registers [GigE Vision 1.2, table 28-1].
constexpr std::uint32_t kVersion = 0x0000, kDeviceMode = 0x0004, kCurrentAddress = 0x0024, kSubnetMask = 0x0034,
                        kMaker = 0x0048, kModel = 0x0068, kDeviceVersion = 0x0088, kSerial = 0x00d8, kXmlUrl = 0x0200,
                        kInterfaces = 0x0600, kStreams = 0x0904, kCapability = 0x0934, kHeartbeat = 0x0938,
                        kTickRate = 0x0940, kPrivilege = 0x0a00, kStreamPort = 0x0d00, kPacketSize = 0x0d04,
                        kPacketDelay = 0x0d08, kStreamAddress = 0x0d18, kStreamSource = 0x0d1c;
constexpr std::uint32_t kBootstrapBytes = 0x1000, kDiscoveryBytes = 0x00f8, kXmlAddress = 0x100000;

void put(std::span<std::uint8_t> to, std::size_t at, std::uint64_t value, int bytes = 4) {
  for (int i = 0; i < bytes; ++i)
    to[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(value >> (8 * (bytes - 1 - i)));
}

std::uint32_t get(std::span<const std::uint8_t> from, std::size_t at, int bytes = 4) {
  std::uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | from[at + static_cast<std::size_t>(i)];
  return value;
}

void put_text(std::span<std::uint8_t> to, std::size_t at, std::string_view text) {
  std::ranges::copy(text, to.begin() + static_cast<std::ptrdiff_t>(at));
}

int udp_socket(const std::string& address, std::uint16_t port, bool shared) {
  const int made = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &own.sin_addr);
  const int yes = 1;
  if (shared) ::setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(made, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return made;
  ::close(made);
  return -1;
}

bool same(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

}  // namespace

struct GigeWire::Request {
  sockaddr_in from{};
  std::uint16_t command = 0, id = 0;
  std::span<const std::uint8_t> payload;
};

Result<std::unique_ptr<GigeWire>> GigeWire::open(const GigeWireOptions& options, Handlers handlers, Clock& clock) {
  std::unique_ptr<GigeWire> wire(new GigeWire(options, std::move(handlers), clock));
  if (auto bound = wire->bind_sockets(); !bound) return pass_on(bound);
  wire->fill_bootstrap();
  wire->server_ = std::jthread([self = wire.get()](const std::stop_token& stop) { self->serve(stop); });
  return wire;
}

GigeWire::GigeWire(const GigeWireOptions& options, Handlers handlers, Clock& clock)
    : options_(options), handlers_(std::move(handlers)), clock_(clock), bootstrap_(kBootstrapBytes) {}

GigeWire::~GigeWire() {
  if (server_.joinable()) {
    server_.request_stop();
    server_.join();
  }
  for (const int socket : control_) {
    if (socket >= 0) ::close(socket);
  }
  if (stream_ >= 0) ::close(stream_);
}

Result<void> GigeWire::bind_sockets() {
  control_ = {udp_socket(options_.address, kControlPort, false), udp_socket("255.255.255.255", kControlPort, true),
              udp_socket("127.255.255.255", kControlPort, true)};
  stream_ = udp_socket(options_.address, 0, false);
  if (control_[0] >= 0 && stream_ >= 0) return {};
  return fail(ErrorCode::io, "GigE camera on {}: the address or its port cannot be used", options_.address);
}

void GigeWire::fill_bootstrap() {
  constexpr std::uint32_t kVersion12 = 0x00010002, kBigEndianUtf8 = 0x80000001, kHasSerial = 0x40000000,
                          kWritesMemory = 0x2, kHeartbeatMs = 3000, kTicks = 1'000'000'000;
  const std::span<std::uint8_t> all(bootstrap_);
  in_addr own{};
  ::inet_pton(AF_INET, options_.address.c_str(), &own);
  sockaddr_in source{};
  socklen_t size = sizeof source;
  ::getsockname(stream_, reinterpret_cast<sockaddr*>(&source), &size);
  put(all, kVersion, kVersion12);
  put(all, kDeviceMode, kBigEndianUtf8);
  put(all, 0x000c, ntohl(own.s_addr));  // lower part of a MAC address
  put(all, kCurrentAddress, ntohl(own.s_addr));
  put(all, kSubnetMask, 0xff000000);
  put_text(all, kMaker, "scanrig");
  put_text(all, kModel, "Twin");
  put_text(all, kDeviceVersion, "1");
  put_text(all, kSerial, options_.serial);
  put_text(all, kXmlUrl, fmt::format("Local:twin.xml;{:x};{:x}", kXmlAddress, options_.description.size()));
  put(all, kInterfaces, 1);
  put(all, kStreams, 1);
  put(all, kCapability, kHasSerial | kWritesMemory);
  put(all, kHeartbeat, kHeartbeatMs);
  put(all, kTickRate, kTicks);
  put(all, kPacketSize, options_.packet_bytes);
  put(all, kPacketDelay, options_.packet_delay_ns);
  put(all, kStreamSource, ntohs(source.sin_port));
}

void GigeWire::serve(const std::stop_token& stop) {
  constexpr int kPollMs = 50;
  std::array<pollfd, 3> watched{};
  for (std::size_t i = 0; i < control_.size(); ++i) watched[i] = {control_[i], POLLIN, 0};
  while (!stop.stop_requested()) {
    if (::poll(watched.data(), watched.size(), kPollMs) > 0) {
      for (const pollfd& one : watched) {
        if ((one.revents & POLLIN) != 0) receive(one.fd);
      }
    } else {
      abandon_if_silent();
    }
  }
}

void GigeWire::receive(int socket) {
  std::array<std::uint8_t, 2048> bytes{};
  Request request;
  socklen_t size = sizeof request.from;
  const auto count =
      ::recvfrom(socket, bytes.data(), bytes.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&request.from), &size);
  if (count < static_cast<ssize_t>(kHeader) || bytes[0] != kKey) return;
  const std::span<const std::uint8_t> packet(bytes.data(), static_cast<std::size_t>(count));
  request.command = static_cast<std::uint16_t>(get(packet, 2, 2));
  request.id = static_cast<std::uint16_t>(get(packet, 6, 2));
  request.payload = packet.subspan(kHeader);
  if (request.payload.size() < get(packet, 4, 2)) return;
  {
    const std::scoped_lock lock(mutex_);
    if (controller_ && same(*controller_, request.from)) last_request_ = clock_.now();
  }
  answer(request);
}

void GigeWire::answer(const Request& request) {
  constexpr std::uint16_t kAcknowledged = 1;  // added to the command
  switch (request.command) {
    case kDiscovery:
      reply(request, kDiscovery + kAcknowledged, GvcpStatus::success, std::span(bootstrap_).first(kDiscoveryBytes));
      return;
    case kReadRegister: read_registers(request); return;
    case kWriteRegister: write_registers(request); return;
    case kReadMemory: read_memory(request); return;
    case kWriteMemory: write_memory(request); return;
    default: return;  // a request for packets again, too: they are gone
  }
}

void GigeWire::reply(const Request& request, std::uint16_t command, GvcpStatus status,
                     std::span<const std::uint8_t> payload) const {
  std::vector<std::uint8_t> packet(kHeader + payload.size());
  put(packet, 0, static_cast<std::uint16_t>(status), 2);
  put(packet, 2, command, 2);
  put(packet, 4, payload.size(), 2);
  put(packet, 6, request.id, 2);
  std::ranges::copy(payload, packet.begin() + kHeader);
  ::sendto(control_[0], packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&request.from),
           sizeof request.from);
}

std::optional<std::uint32_t> GigeWire::read_word(std::uint32_t address) const {
  if (address + 4 <= kBootstrapBytes && address % 4 == 0) {
    const std::scoped_lock lock(mutex_);
    return get(bootstrap_, address);
  }
  return handlers_.read(address);
}

void GigeWire::read_registers(const Request& request) {
  std::vector<std::uint8_t> values;
  for (std::size_t at = 0; at + 4 <= request.payload.size(); at += 4) {
    const auto word = read_word(get(request.payload, at));
    if (!word) return reply(request, kReadRegister + 1, GvcpStatus::invalid_address, values);
    values.resize(values.size() + 4);
    put(values, values.size() - 4, *word);
  }
  reply(request, kReadRegister + 1, GvcpStatus::success, values);
}

void GigeWire::read_memory(const Request& request) {
  if (request.payload.size() < 8) return;
  const std::uint32_t address = get(request.payload, 0);
  const std::size_t count = std::min<std::size_t>(get(request.payload, 6, 2), kMaxRead);
  std::vector<std::uint8_t> values(4 + count);
  put(values, 0, address);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = address + i;
    std::uint8_t byte = 0;  // beyond the description's end
    if (at < kBootstrapBytes) {
      const std::scoped_lock lock(mutex_);
      byte = bootstrap_[at];
    } else if (at >= kXmlAddress) {
      if (at - kXmlAddress < options_.description.size()) {
        byte = static_cast<std::uint8_t>(options_.description[at - kXmlAddress]);
      }
    } else {
      const auto word = handlers_.read(static_cast<std::uint32_t>(at / 4 * 4));
      if (!word) return reply(request, kReadMemory + 1, GvcpStatus::invalid_address, {});
      byte = static_cast<std::uint8_t>(*word >> (8 * (3 - at % 4)));
    }
    values[4 + i] = byte;
  }
  reply(request, kReadMemory + 1, GvcpStatus::success, values);
}

void GigeWire::write_registers(const Request& request) {
  std::array<std::uint8_t, 4> written{};
  std::uint16_t count = 0;
  GvcpStatus status = GvcpStatus::success;
  for (std::size_t at = 0; at + 8 <= request.payload.size() && status == GvcpStatus::success; at += 8) {
    status = write_word(request, get(request.payload, at), get(request.payload, at + 4));
    if (status == GvcpStatus::success) ++count;
  }
  put(written, 2, count, 2);
  reply(request, kWriteRegister + 1, status, written);
}

/// Words that follow the address of the first.
void GigeWire::write_memory(const Request& request) {
  std::array<std::uint8_t, 4> written{};
  std::uint16_t count = 0;
  GvcpStatus status = request.payload.size() < 8 ? GvcpStatus::invalid_parameter : GvcpStatus::success;
  for (std::size_t at = 4; at + 4 <= request.payload.size() && status == GvcpStatus::success; at += 4) {
    status =
        write_word(request, get(request.payload, 0) + static_cast<std::uint32_t>(at - 4), get(request.payload, at));
    if (status == GvcpStatus::success) count = static_cast<std::uint16_t>(count + 4);
  }
  put(written, 2, count, 2);
  reply(request, kWriteMemory + 1, status, written);
}

GvcpStatus GigeWire::write_word(const Request& request, std::uint32_t address, std::uint32_t value) {
  if (address < kBootstrapBytes) return write_bootstrap(request, address, value);
  {
    const std::scoped_lock lock(mutex_);
    if (!controller_ || !same(*controller_, request.from)) return GvcpStatus::access_denied;
  }
  return handlers_.write(address, value);
}

GvcpStatus GigeWire::write_bootstrap(const Request& request, std::uint32_t address, std::uint32_t value) {
  const bool is_acquiring = handlers_.is_acquiring();
  std::unique_lock lock(mutex_);
  const bool controls = controller_ && same(*controller_, request.from);
  if (address == kPrivilege) {
    if (controller_ && !controls) return GvcpStatus::access_denied;
    put(bootstrap_, kPrivilege, value);
    controller_ = value != 0 ? std::optional(request.from) : std::nullopt;
    last_request_ = clock_.now();
    if (value == 0) put(bootstrap_, kStreamPort, 0);
    lock.unlock();
    if (value == 0) handlers_.on_abandoned();
    return GvcpStatus::success;
  }
  if (!controls) return GvcpStatus::access_denied;
  constexpr std::array kWritable{kHeartbeat, kStreamPort, kPacketSize, kPacketDelay, kStreamAddress};
  if (std::ranges::find(kWritable, address) == kWritable.end()) return GvcpStatus::write_protect;
  if (address == kPacketSize && is_acquiring) return GvcpStatus::access_denied;
  put(bootstrap_, address, value);
  return GvcpStatus::success;
}

/// A host that controls the camera sends requests more often than the heartbeat says.
void GigeWire::abandon_if_silent() {
  std::unique_lock lock(mutex_);
  const std::chrono::milliseconds heartbeat(get(bootstrap_, kHeartbeat));
  if (!controller_ || clock_.now() - last_request_ < heartbeat) return;
  controller_.reset();
  put(bootstrap_, kPrivilege, 0);
  put(bootstrap_, kStreamPort, 0);
  lock.unlock();
  handlers_.on_abandoned();
}

bool GigeWire::is_open() const {
  const std::scoped_lock lock(mutex_);
  return (get(bootstrap_, kStreamPort) & 0xffff) != 0 && get(bootstrap_, kStreamAddress) != 0;
}

namespace {

enum class Part : std::uint8_t { leader = 1, trailer = 2, data = 3 };

void begin_packet(std::vector<std::uint8_t>& packet, std::uint16_t block, Part part, std::uint32_t number) {
  packet.assign(8, 0);
  put(packet, 2, block, 2);
  put(packet, 4, static_cast<std::uint32_t>(part) << 24 | number);
}

std::vector<std::uint8_t> leader_of(const GigeBlock& block) {
  constexpr std::uint16_t kImage = 0x0001, kImageWithChunks = 0x4001;
  std::vector<std::uint8_t> payload(36);
  put(payload, 2, block.has_chunks ? kImageWithChunks : kImage, 2);
  put(payload, 4, block.stamp_ns, 8);
  put(payload, 12, block.pixel_format);
  put(payload, 16, static_cast<std::uint32_t>(block.region.width));
  put(payload, 20, static_cast<std::uint32_t>(block.region.height));
  put(payload, 24, static_cast<std::uint32_t>(block.region.x));
  put(payload, 28, static_cast<std::uint32_t>(block.region.y));
  return payload;
}

}  // namespace

void GigeWire::send(const GigeBlock& block, double lost_share, const std::stop_token& stop) {
  constexpr std::size_t kOverhead = 20 + 8 + 8;  // IP, UDP, and the stream's own header
  constexpr std::chrono::nanoseconds kByte{8};   // of a gigabit link
  sockaddr_in to{};
  to.sin_family = AF_INET;
  std::size_t packet_bytes = 0;
  std::chrono::nanoseconds delay{0};
  {
    const std::scoped_lock lock(mutex_);
    to.sin_port = htons(static_cast<std::uint16_t>(get(bootstrap_, kStreamPort)));
    to.sin_addr.s_addr = htonl(get(bootstrap_, kStreamAddress));
    packet_bytes = std::max<std::size_t>(get(bootstrap_, kPacketSize, 4) & 0xffff, kOverhead + 64);
    delay = std::chrono::nanoseconds(get(bootstrap_, kPacketDelay));
  }
  if (to.sin_port == 0) return;
  std::vector<std::uint8_t> packet;
  Clock::TimePoint free_at = clock_.now();
  const auto transmit = [&] {
    // The link is busy that long; waits of less are made up for later.
    constexpr auto kShortest = std::chrono::microseconds(200);
    if (free_at - clock_.now() > kShortest) clock_.sleep_until(free_at);
    ::sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    free_at += kByte * static_cast<std::int64_t>(packet.size()) + delay;
  };
  std::uint32_t number = 0;
  begin_packet(packet, block.id, Part::leader, number++);
  const auto leader = leader_of(block);
  packet.insert(packet.end(), leader.begin(), leader.end());
  transmit();
  const std::size_t room = packet_bytes - kOverhead;
  for (std::size_t at = 0; at < block.bytes.size() && !stop.stop_requested(); at += room) {
    begin_packet(packet, block.id, Part::data, number++);
    const auto part = std::span(block.bytes).subspan(at, std::min(room, block.bytes.size() - at));
    packet.insert(packet.end(), part.begin(), part.end());
    if (std::uniform_real_distribution<double>(0.0, 1.0)(random_) >= lost_share) transmit();
  }
  begin_packet(packet, block.id, Part::trailer, number);
  packet.resize(16);
  put(packet, 10, block.has_chunks ? 0x4001 : 0x0001, 2);
  put(packet, 12, static_cast<std::uint32_t>(block.region.height));
  transmit();
}

}  // namespace scanrig::sim::wire
