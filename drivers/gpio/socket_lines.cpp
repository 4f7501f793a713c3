#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "drivers/gpio/lines.h"

namespace scanrig::gpio {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAnswerTime{1000};

/// Text commands by line over one connection.
class Connection {
 public:
  static Result<Connection> open(const std::filesystem::path& socket) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket.native().size() >= sizeof(address.sun_path)) {
      return fail(ErrorCode::io, "gpio: the path {} is too long for a socket", socket.string());
    }
    std::memcpy(address.sun_path, socket.c_str(), socket.native().size());
    Connection connection(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(connection.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      return fail(ErrorCode::io, "gpio: connect {}: {}", socket.string(), std::strerror(errno));
    }
    return connection;
  }
  Connection(Connection&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), pending_(std::move(other.pending_)) {}
  Connection& operator=(Connection&&) = delete;
  ~Connection() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  Result<void> send(const std::string& words) {
    const std::string line = words + "\n";
    if (::send(descriptor_, line.data(), line.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(line.size())) return gone();
    return {};
  }
  /// Next line; empty when no whole line arrives within `wait`.
  Result<std::string> receive(milliseconds wait) {
    for (;;) {
      if (const auto end = pending_.find('\n'); end != std::string::npos) {
        const std::string line = pending_.substr(0, end);
        pending_.erase(0, end + 1);
        return line;
      }
      pollfd watched{descriptor_, POLLIN, 0};
      if (::poll(&watched, 1, static_cast<int>(wait.count())) <= 0) return std::string();
      std::array<char, 256> bytes;
      const ssize_t count = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
      if (count <= 0) return pass_on(gone());
      pending_.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  explicit Connection(int descriptor) : descriptor_(descriptor) {}
  static Result<void> gone() { return fail(ErrorCode::io, "gpio: the other end of the socket is gone"); }

  int descriptor_;
  std::string pending_;
};

class SocketOutput final : public Output {
 public:
  SocketOutput(Connection connection, LineSpec line) : connection_(std::move(connection)), line_(std::move(line)) {}
  ~SocketOutput() override {
    if (!line_.keep) std::ignore = set(false);
  }

  Result<void> set(bool active) override {
    auto sent = connection_.send(fmt::format("output {} {}", line_.contact(), active != line_.active_low ? 1 : 0));
    if (!sent) return sent;
    const auto answer = connection_.receive(kAnswerTime);
    if (!answer) return pass_on(answer);
    if (*answer == "ok") return {};
    if (answer->starts_with("unknown")) return fail(ErrorCode::not_found, "gpio: {} line", *answer);
    return fail(ErrorCode::io, "gpio: setting {} was not confirmed", line_.contact());
  }

 private:
  Connection connection_;
  LineSpec line_;
};

/// "101", one digit per line, high or low; nothing for any other text.
std::optional<std::vector<bool>> parse_levels(const std::string& word, const std::vector<LineSpec>& lines) {
  if (word.size() != lines.size() || word.find_first_not_of("01") != std::string::npos) return std::nullopt;
  std::vector<bool> levels;
  for (std::size_t i = 0; i < lines.size(); ++i) levels.push_back((word[i] == '1') != lines[i].active_low);
  return levels;
}

class SocketInputs final : public Inputs {
 public:
  SocketInputs(Connection connection, std::vector<LineSpec> lines, std::vector<bool> levels, Clock& clock)
      : connection_(std::move(connection)), lines_(std::move(lines)), levels_(std::move(levels)), clock_(clock) {}

  Result<std::vector<bool>> wait_change(const std::vector<bool>& known, Deadline deadline) override {
    while (levels_ == known && !deadline.expired(clock_)) {
      const auto word = connection_.receive(std::chrono::ceil<milliseconds>(deadline.left(clock_)));
      if (!word) return pass_on(word);
      if (word->empty()) continue;
      auto levels = parse_levels(*word, lines_);
      if (!levels) return fail(ErrorCode::io, "gpio: the socket said \"{}\", which is no levels", *word);
      levels_ = std::move(*levels);
    }
    return levels_;
  }

 private:
  Connection connection_;
  std::vector<LineSpec> lines_;
  std::vector<bool> levels_;
  Clock& clock_;
};

class SocketLines final : public Lines {
 public:
  SocketLines(std::filesystem::path socket, Clock& clock) : socket_(std::move(socket)), clock_(clock) {}

  Result<std::unique_ptr<Output>> output(const LineSpec& line) override {
    auto connection = Connection::open(socket_);
    if (!connection) return pass_on(connection);
    auto made = std::make_unique<SocketOutput>(std::move(*connection), line);
    if (auto off = made->set(false); !off) return pass_on(off);
    return made;
  }

  Result<std::unique_ptr<Inputs>> inputs(const std::vector<LineSpec>& lines) override {
    auto connection = Connection::open(socket_);
    if (!connection) return pass_on(connection);
    std::string words = "inputs";
    for (const auto& line : lines) words.append(" ").append(line.contact());
    if (auto sent = connection->send(words); !sent) return pass_on(sent);
    const auto answer = connection->receive(kAnswerTime);
    if (!answer) return pass_on(answer);
    if (answer->starts_with("unknown")) return fail(ErrorCode::not_found, "gpio: {} line", *answer);
    auto levels = parse_levels(*answer, lines);
    if (!levels) return fail(ErrorCode::io, "gpio: reading the inputs was not answered");
    return std::make_unique<SocketInputs>(std::move(*connection), lines, std::move(*levels), clock_);
  }

 private:
  const std::filesystem::path socket_;
  Clock& clock_;
};

}  // namespace

std::unique_ptr<Lines> socket_lines(std::filesystem::path socket, Clock& clock) {
  return std::make_unique<SocketLines>(std::move(socket), clock);
}

}  // namespace scanrig::gpio
