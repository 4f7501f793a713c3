#include "daemon/webhook/webhook.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "daemon/runtime/actor.h"

namespace scanrig {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = net::ip::tcp;

struct Lookup {
  std::mutex mutex;
  std::condition_variable_any changed;
  bool over = false;
  boost::system::error_code error;
  Tcp::resolver::results_type found;
};

/// A name server may take any time, and the C library's look-up cannot be cancelled. It has a separate thread,
/// and a caller that stops waiting abandons it.
std::shared_ptr<Lookup> look_up(const HttpAddress& address) {
  auto lookup = std::make_shared<Lookup>();
  std::thread([lookup, host = address.host, port = address.port] {
    boost::system::error_code error;
    Tcp::resolver::results_type found;
    try {
      net::io_context io;
      found = Tcp::resolver(io).resolve(host, port, error);
    } catch (const boost::system::system_error& e) {
      error = e.code();
    }
    const std::lock_guard guard(lookup->mutex);
    lookup->error = error;
    lookup->found = std::move(found);
    lookup->over = true;
    lookup->changed.notify_all();
  }).detach();
  return lookup;
}

/// One exchange, step by step; every step runs in the io_context of the caller.
class Exchange {
 public:
  Exchange(net::io_context& io, const HttpAddress& address, const Tcp::resolver::results_type& found,
           const std::string& json)
      : stream_(io) {
    request_ = {http::verb::post, address.path, 11};
    request_.set(http::field::host, address.host);
    request_.set(http::field::content_type, "application/json");
    request_.keep_alive(false);
    request_.body() = json;
    request_.prepare_payload();
    stream_.async_connect(found, [this](auto error, const auto&) {
      if (!end(error)) write();
    });
  }

  /// Empty while it is not over.
  std::optional<boost::system::error_code> ended{};
  http::response<http::string_body> response;

 private:
  bool end(boost::system::error_code error) {
    if (error) ended = error;
    return ended.has_value();
  }
  void write() {
    http::async_write(stream_, request_, [this](auto error, auto) {
      if (!end(error)) read();
    });
  }
  void read() {
    http::async_read(stream_, buffer_, response, [this](auto error, auto) { ended = error; });
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{64 * 1024};
  http::request<http::string_body> request_;
};

constexpr int kTries = 3;
constexpr auto kLimit = std::chrono::seconds(5);
constexpr auto kPause = std::chrono::seconds(2);

bool is_bad(const JobInfo& job) {
  return job.state == JobState::failed || job.state == JobState::interrupted ||
         (job.state == JobState::done && job.passed == false);
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string news_of(const JobInfo& job) {
  return to_text({{"event", "job"},
                  {"job", job.id},
                  {"part", job.part},
                  {"state", to_string(job.state)},
                  {"code", job.error ? to_string(job.error->code) : ""},
                  {"message", job.error ? job.error->message : ""}});
}

}  // namespace

Result<void> http_post(const HttpAddress& address, const std::string& json, std::chrono::milliseconds limit,
                       const std::stop_token& stop) {
  const auto end = std::chrono::steady_clock::now() + limit;
  const auto failed = [&](boost::system::error_code error) {
    return fail(ErrorCode::io, "{}:{}: {}", address.host, address.port, error.message());
  };
  const auto unanswered = [&] {
    if (stop.stop_requested()) return fail(ErrorCode::stopped, "{}:{}: stopped", address.host, address.port);
    return fail(ErrorCode::timeout, "{}:{} did not answer within {} ms", address.host, address.port, limit.count());
  };
  try {
    const auto lookup = look_up(address);
    std::unique_lock lock(lookup->mutex);
    if (!lookup->changed.wait_until(lock, stop, end, [&] { return lookup->over; })) return unanswered();
    if (lookup->error) return failed(lookup->error);

    net::io_context io;
    Exchange exchange(io, address, lookup->found, json);
    const std::stop_callback stopping(stop, [&io] { io.stop(); });
    io.run_until(end);
    if (!exchange.ended) return unanswered();
    if (*exchange.ended) return failed(*exchange.ended);
    const auto status = exchange.response.result_int();
    if (status / 100 == 2) return {};
    return fail(ErrorCode::protocol, "{}:{} answered with {}", address.host, address.port, status);
  } catch (const std::exception& e) {
    return fail(ErrorCode::io, "{}:{}: {}", address.host, address.port, e.what());
  }
}

std::vector<std::string> alerts(const Snapshot& before, const Snapshot& now) {
  std::vector<std::string> messages;
  for (const auto& [id, job] : now.jobs) {
    const auto was = before.jobs.find(id);
    const bool known = was != before.jobs.end() && (was->second == job || is_bad(*was->second));
    if (is_bad(*job) && !known) messages.push_back(news_of(*job));
  }
  if (now.machine == MachineState::error && before.machine != MachineState::error) {
    messages.push_back(to_text({{"event", "machine"}, {"state", to_string(now.machine)}, {"message", now.cause}}));
  }
  const auto &old = before.calibration_problem, &problem = now.calibration_problem;
  if (problem && (!old || old->message != problem->message)) {
    messages.push_back(
        to_text({{"event", "calibration"}, {"code", to_string(problem->code)}, {"message", problem->message}}));
  }
  return messages;
}

Webhook::Webhook(Clock& clock, HttpAddress address)
    : clock_(clock), address_(std::move(address)), inbox_(clock), thread_(start_actor(clock, [this] { run(); })) {}

Webhook::~Webhook() {
  {
    const std::lock_guard guard(mutex_);
    stop_.request_stop();
  }
  clock_.notify_all(stopped_);
  inbox_.close();
  thread_.join();
}

/// Problems from before the daemon's start are not reported.
void Webhook::look(std::shared_ptr<const Snapshot> now) {
  if (before_) {
    for (auto& message : alerts(*before_, *now)) inbox_.post(std::move(message));
  }
  before_ = std::move(now);
}

void Webhook::run() {
  while (const auto message = inbox_.take()) {
    for (int i = 0; i < kTries && !stop_.stop_requested(); ++i) {
      if (http_post(address_, *message, kLimit, stop_.get_token())) break;
      if (i + 1 < kTries) pause();
    }
  }
}

void Webhook::pause() {
  std::unique_lock lock(mutex_);
  clock_.wait_until(lock, stopped_, clock_.now() + kPause, [this] { return stop_.stop_requested(); });
}

}  // namespace scanrig
