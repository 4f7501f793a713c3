#include "sim/wire/grbl_server.h"

#include <fmt/format.h>

#include <utility>

namespace scanrig::sim::wire {
namespace {

constexpr std::chrono::milliseconds kPollInterval{2};  ///< maximum delay of unsolicited output

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace

Result<std::unique_ptr<GrblServer>> GrblServer::start(std::filesystem::path link, GrblController& controller,
                                                      Clock& clock) {
  std::unique_ptr<GrblServer> server(new GrblServer(std::move(link), controller, clock));
  if (auto plugged = server->come_back(); !plugged) return pass_on(plugged);
  return server;
}

void GrblServer::on_request(std::function<void(const std::string&)> listener) {
  const std::scoped_lock lock(listener_mutex_);
  listener_ = std::move(listener);
}

void GrblServer::serve(const std::stop_token& stop, Pty& pty) {
  std::string line;
  while (!stop.stop_requested()) {
    for (const auto byte : pty.read(kPollInterval)) {
      const char c = static_cast<char>(byte);
      if (GrblController::is_realtime(c)) {
        if (c == 0x18) line.clear();
        handle(stop, pty, std::string(1, c), true);
      } else if (c == '\n' || c == '\r') {
        handle(stop, pty, std::exchange(line, {}), false);
      } else {
        line += c;
      }
    }
    // Late output is the reply to "$H", or an alarm.
    if (const std::string output = controller_.take_output(); !output.empty())
      send(stop, pty, bytes_of(output), next_fault('$'));
  }
}

void GrblServer::handle(const std::stop_token& stop, Pty& pty, const std::string& request, bool realtime) {
  note(true, bytes_of(realtime ? request : request + "\n"));
  const auto fault = next_fault(request.empty() ? std::uint8_t{'\n'} : static_cast<std::uint8_t>(request.front()));
  using Kind = WireFault::Kind;
  if (fault && fault->kind == Kind::request_lost) return;
  std::function<void(const std::string&)> listener;
  {
    const std::scoped_lock lock(listener_mutex_);
    listener = listener_;
  }
  if (listener) listener(request);
  if (fault && fault->kind == Kind::refuse) {
    return send(stop, pty, bytes_of(fmt::format("error:{}\r\n", fault->exception)), fault);
  }
  std::string reply = controller_.take_output();  // output so far, for example an alarm
  if (realtime) {
    reply += controller_.realtime(request.front());
  } else {
    controller_.line(request);
  }
  reply += controller_.take_output();
  send(stop, pty, bytes_of(reply), fault);
}

}  // namespace scanrig::sim::wire
