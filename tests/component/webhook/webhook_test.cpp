#include "daemon/webhook/webhook.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <optional>
#include <thread>

namespace {

std::atomic<bool> name_server_is_dead = false;

}  // namespace

/// The C library's, but for a name server that may be dead: then a reply comes late, as from a real one.
extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints, addrinfo** found) {
  for (int i = 0; i < 600 && name_server_is_dead; ++i) ::usleep(10'000);
  return reinterpret_cast<decltype(&::getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"))(node, service, hints, found);
}

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A server that takes one request on the loopback interface and sends the given reply.
class Listener {
 public:
  Listener() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port = std::to_string(ntohs(address.sin_port));
    ::listen(socket_, 4);
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// Waits until a client has connected; it never gets a reply.
  void wait_for_peer() {
    pollfd watched{socket_, POLLIN, 0};
    ::poll(&watched, 1, -1);
  }
  /// The request's text.
  std::future<std::string> answer(const std::string& with) {
    return std::async(std::launch::async, [this, with] {
      const int peer = ::accept(socket_, nullptr, nullptr);
      std::string text;
      char buffer[2048];
      while (text.find('}') == std::string::npos) {
        const auto got = ::recv(peer, buffer, sizeof buffer, 0);
        if (got <= 0) break;
        text.append(buffer, static_cast<std::size_t>(got));
      }
      ::send(peer, with.data(), with.size(), MSG_NOSIGNAL);
      ::close(peer);
      return text;
    });
  }
  std::string port;

 private:
  int socket_;
};

std::shared_ptr<const JobInfo> job(const std::string& id, JobState state, std::optional<bool> passed = {}) {
  return std::make_shared<const JobInfo>(JobInfo{
      .id = id, .state = state, .part = "4711", .passed = passed, .error = Error{ErrorCode::moved, "it \"moved\""}});
}

Snapshot with(JobTable jobs, MachineState machine = MachineState::ready) {
  Snapshot snapshot;
  snapshot.jobs = std::move(jobs);
  snapshot.machine = machine;
  snapshot.cause = "The guard was opened.";
  return snapshot;
}

TEST(BadNews, IsAJobThatFailsIsInterruptedOrDoesNotPass) {
  const auto before = with({{"a", job("a", JobState::scanning)}});
  for (const auto state : {JobState::failed, JobState::interrupted}) {
    const auto messages = alerts(before, with({{"a", job("a", state)}}));
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_THAT(messages[0], HasSubstr(R"("job":"a","part":"4711")"));
    EXPECT_THAT(messages[0], HasSubstr(R"("code":"moved","message":"it \"moved\"")"));
  }
  EXPECT_EQ(alerts(before, with({{"a", job("a", JobState::done, false)}})).size(), 1u);
  EXPECT_THAT(alerts(before, with({{"a", job("a", JobState::done, true)}})), IsEmpty());
  EXPECT_THAT(alerts(before, with({{"a", job("a", JobState::cancelled)}})), IsEmpty());
}

TEST(BadNews, IsToldOnce) {
  const auto failed = with({{"a", job("a", JobState::failed)}});
  EXPECT_THAT(alerts(failed, with({{"a", job("a", JobState::failed)}})), IsEmpty());
}

TEST(BadNews, IsAFaultOfTheMachine) {
  const auto messages = alerts(with({}), with({}, MachineState::error));
  EXPECT_THAT(messages, ElementsAre(HasSubstr("The guard was opened.")));
}

TEST(BadNews, IsACalibrationThatRefusesTheNextScan) {
  const auto refusing = [](const std::string& why) {
    Snapshot snapshot = with({});
    snapshot.calibration_problem = Error{ErrorCode::not_found, why};
    return snapshot;
  };
  EXPECT_THAT(alerts(with({}), refusing("other cameras")),
              ElementsAre(R"({"event":"calibration","code":"not_found","message":"other cameras"})"));
  EXPECT_THAT(alerts(refusing("other cameras"), refusing("other cameras")), IsEmpty());
  EXPECT_THAT(alerts(refusing("other cameras"), with({})), IsEmpty());
}

TEST(HttpPost, SendsJson) {
  Listener listener;
  auto request = listener.answer("HTTP/1.1 204 No Content\r\n\r\n");
  const auto sent = http_post({"127.0.0.1", listener.port, "/hook?a=1"}, R"({"job":"a"})", milliseconds(5000));
  EXPECT_TRUE(sent) << sent.error().message;
  const auto text = request.get();
  EXPECT_THAT(text, HasSubstr("POST /hook?a=1 HTTP/1.1"));
  EXPECT_THAT(text, HasSubstr("application/json"));
  EXPECT_THAT(text, HasSubstr(R"({"job":"a"})"));
}

TEST(HttpPost, SaysWhatIsWrong) {
  Listener listener;
  auto refused = listener.answer("HTTP/1.1 500 Oops\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(http_post({"127.0.0.1", listener.port, "/"}, "{}", milliseconds(5000)).error().code, ErrorCode::protocol);
  refused.wait();
  auto cut = listener.answer("");
  EXPECT_EQ(http_post({"127.0.0.1", listener.port, "/"}, "{}", milliseconds(5000)).error().code, ErrorCode::io);
  cut.wait();
  EXPECT_EQ(http_post({"127.0.0.1", listener.port, "/"}, "{}", milliseconds(50)).error().code, ErrorCode::timeout);
  EXPECT_EQ(http_post({"127.0.0.1", "1", "/"}, "{}", milliseconds(5000)).error().code, ErrorCode::io);
}

TEST(Webhook, TellsWhatGoesWrongAfterItsStart) {
  Listener listener;
  auto request = listener.answer("HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n");
  RealClock clock;
  Webhook webhook(clock, {"127.0.0.1", listener.port, "/"});
  webhook.look(std::make_shared<Snapshot>(with({{"old", job("old", JobState::failed)}})));
  webhook.look(
      std::make_shared<Snapshot>(with({{"old", job("old", JobState::failed)}, {"new", job("new", JobState::failed)}})));
  EXPECT_THAT(request.get(), HasSubstr(R"("job":"new")"));
}

/// The daemon ends to restart: systemd's watchdog waits 5 s, and the rig is stopped meanwhile.
class ClosingAWebhook : public testing::Test {
 protected:
  /// A webhook with a message to send.
  void open(const std::string& port) {
    webhook_.emplace(clock_, HttpAddress{"127.0.0.1", port, "/"});
    webhook_->look(std::make_shared<Snapshot>(with({})));
    webhook_->look(std::make_shared<Snapshot>(with({{"new", job("new", JobState::failed)}})));
  }
  Clock::Duration closing() {
    const auto begun = clock_.now();
    webhook_.reset();
    return clock_.now() - begun;
  }
  static constexpr auto kAtOnce = milliseconds(1000);  // every wait there is takes at least 2 s
  RealClock clock_;
  Listener listener_;
  std::optional<Webhook> webhook_;
};

TEST_F(ClosingAWebhook, WaitsForNoAnswer) {
  open(listener_.port);
  listener_.wait_for_peer();
  EXPECT_LT(closing(), kAtOnce);
}

TEST_F(ClosingAWebhook, WaitsForNoSecondTry) {
  auto refused = listener_.answer("HTTP/1.1 500 Oops\r\nContent-Length: 0\r\n\r\n");
  open(listener_.port);
  refused.wait();
  EXPECT_LT(closing(), kAtOnce);
}

TEST_F(ClosingAWebhook, WaitsForNoNameServer) {
  name_server_is_dead = true;
  open(listener_.port);
  EXPECT_LT(closing(), kAtOnce);
  name_server_is_dead = false;
}

TEST(HttpPost, WaitsForANameServerNoLongerThanForTheRest) {
  RealClock clock;
  name_server_is_dead = true;
  const auto begun = clock.now();
  EXPECT_EQ(http_post({"127.0.0.1", "1", "/"}, "{}", milliseconds(50)).error().code, ErrorCode::timeout);
  EXPECT_LT(clock.now() - begun, seconds(3));
  name_server_is_dead = false;
}

TEST(HttpPost, EndsWhenItIsToldTo) {
  Listener listener;
  std::stop_source stop;
  std::jthread stopper([&] {
    listener.wait_for_peer();
    stop.request_stop();
  });
  const auto sent = http_post({"127.0.0.1", listener.port, "/"}, "{}", seconds(60), stop.get_token());
  EXPECT_EQ(sent.error().code, ErrorCode::stopped);
}

}  // namespace
}  // namespace scanrig
