#include "sim/apps/truth_socket.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace scanrig::sim {
namespace {

constexpr timeval kReplyTimeout{.tv_sec = 1, .tv_usec = 0};
constexpr std::size_t kMaxReplyLength = 4096;

}  // namespace

TruthSocket::~TruthSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

tl::unexpected<Error> TruthSocket::lost(ErrorCode code, const std::string& why) {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  pending_.clear();
  return fail(code, "simulated camera: reading the table's angle from {}: {}", path_.string(), why);
}

Result<void> TruthSocket::connect() {
  if (descriptor_ >= 0) return {};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.native().size() >= sizeof(address.sun_path)) return lost(ErrorCode::io, "the path is too long");
  std::memcpy(address.sun_path, path_.c_str(), path_.native().size());
  descriptor_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &kReplyTimeout, sizeof kReplyTimeout);
  if (::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return {};
  return lost(ErrorCode::io, std::strerror(errno));
}

Result<std::string> TruthSocket::request() {
  constexpr std::string_view kRequest = "{\"get\":\"truth\"}\n";
  if (::send(descriptor_, kRequest.data(), kRequest.size(), MSG_NOSIGNAL) != ssize_t{kRequest.size()}) {
    return lost(ErrorCode::io, "the simulator has gone");
  }
  for (;;) {
    if (const auto end = pending_.find('\n'); end != std::string::npos) {
      std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      return line;
    }
    std::array<char, 512> bytes;
    const ssize_t count = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return lost(ErrorCode::timeout, "no reply within 1 s");
    if (count <= 0) return lost(ErrorCode::io, "the simulator has gone");
    pending_.append(bytes.data(), static_cast<std::size_t>(count));
    if (pending_.size() > kMaxReplyLength) return lost(ErrorCode::protocol, "the reply has no end");
  }
}

Result<TableTruth> TruthSocket::get() {
  if (auto connected = connect(); !connected) return pass_on(connected);
  const auto line = request();
  if (!line) return pass_on(line);
  const auto json = nlohmann::json::parse(*line, nullptr, false);
  const auto is = [&](const char* key, bool (nlohmann::json::*kind)() const noexcept) {
    return json.is_object() && json.contains(key) && (json[key].*kind)();
  };
  if (!is("angle_deg", &nlohmann::json::is_number) || !is("speed_deg_s", &nlohmann::json::is_number) ||
      !is("stopped", &nlohmann::json::is_boolean) || !is("projector_on", &nlohmann::json::is_boolean)) {
    return lost(ErrorCode::protocol, "malformed reply: " + *line);
  }
  return TableTruth{json["angle_deg"], json["speed_deg_s"], json["stopped"], json["projector_on"]};
}

}  // namespace scanrig::sim
