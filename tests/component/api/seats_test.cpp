#include <pwd.h>

#include <tuple>

#include "daemon/ctl/client.h"
#include "tests/component/api/api_bench.h"
#include "tests/slowness.h"

namespace scanrig {
namespace {

using api_bench::ApiBench;
using api_bench::Wire;
using std::chrono::milliseconds;
using testing::Each;
using testing::HasSubstr;
using testing::Le;
using Steady = std::chrono::steady_clock;

class SeatsOfTheApi : public ApiBench {
 protected:
  std::string stop(Role role = Role::viewer) const { return request("POST", "/api/v1/stop", tokens.at(role)); }
  std::string health(const std::string& more = "") const {
    return request("GET", "/api/v1/health", tokens.at(Role::viewer), "", more);
  }
  /// Connections that send nothing, half a header, or a byte now and then, from 127.0.0.1 to .4.
  std::vector<Wire> idle(int count) const {
    std::vector<Wire> wires;
    for (int i = 0; i < count; ++i) {
      wires.push_back(tcp(1 + static_cast<std::uint32_t>(i % 4)));
      if (i % 3 == 1) wires.back().say("POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bear");
      if (i % 3 == 2) wires.back().say("G");
    }
    return wires;
  }
  template <class Request>
  static double milliseconds_for(const Request& request) {
    const auto begun = Steady::now();
    request();
    return std::chrono::duration<double, std::milli>(Steady::now() - begun).count();
  }
  /// The same steps as the command line's client for `scanrig stop`.
  void stop_locally() const {
    const auto stopped = ctl::send_request(options.socket, "POST", "/api/v1/stop");
    EXPECT_TRUE(stopped) << (stopped ? "" : stopped.error().message);
  }
};

TEST_F(SeatsOfTheApi, StopIsServedWithin100MsBeside300IdleAndSlowConnections) {
  serve();
  const auto wires = idle(300);
  std::vector<double> late_ms;
  for (int i = 0; i < 20; ++i) {
    for (const auto& wire : wires) std::ignore = wire.say("e");
    late_ms.push_back(milliseconds_for([&] { stop_locally(); }));
    const auto host = 1 + static_cast<std::uint32_t>(i % 4);
    late_ms.push_back(milliseconds_for([&] { EXPECT_EQ(ask(tcp(host), stop()).status, 200) << host; }));
  }
  EXPECT_THAT(late_ms, Each(Le(100.0 * kSlowness)));
}

TEST_F(SeatsOfTheApi, ANewRequestIsAlwaysReadAndTheOldestThatWaitsIsCutOff) {
  options.limits.waiting = 4;
  serve();
  auto oldest = tcp();
  std::vector<Wire> wires;
  for (int i = 0; i < 4; ++i) wires.push_back(tcp());
  EXPECT_EQ(ask(tcp(), health()).status, 200);
  EXPECT_TRUE(oldest.ended());
}

TEST_F(SeatsOfTheApi, ARequestWithoutATokenTakesNoSeat) {
  options.limits.connections = 1;
  serve();
  auto wire = tcp();
  ASSERT_TRUE(wire.say(request("GET", "/api/v1/health")));
  EXPECT_EQ(wire.answer().status, 401);
  EXPECT_TRUE(wire.ended());
  EXPECT_EQ(ask(tcp(), health()).status, 200);
}

TEST_F(SeatsOfTheApi, WhereNoSeatIsFreeStopAndStatusAreServedAndNothingElse) {
  options.limits.connections_a_peer = 1;
  serve();
  auto stream = tcp();
  ASSERT_TRUE(stream.say(request("GET", "/api/v1/events", tokens[Role::viewer])));
  stream.hear("\n\n");
  const auto refused = ask(tcp(), health());
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.json()["error"]["code"], "busy");
  for (int i = 0; i < 40; ++i) ASSERT_EQ(ask(tcp(), stop()).status, 200) << "more than there are reserved seats";
  auto wire = tcp();
  ASSERT_TRUE(wire.say(request("GET", "/api/v1/status", tokens[Role::viewer])));
  const auto status = wire.answer();
  EXPECT_EQ(status.status, 200);
  EXPECT_THAT(status.head, HasSubstr("Connection: close"));
  EXPECT_TRUE(wire.ended()) << "a reserved seat is for one request";
  EXPECT_EQ(ask(tcp(), request("POST", "/api/v1/stop", "scanrig_0")).status, 401);
  EXPECT_EQ(ask(local(), request("GET", "/api/v1/health")).status, 200) << "the socket has seats of its own";
}

TEST_F(SeatsOfTheApi, TwoPeersDoNotLockOutAThird) {
  options.limits.connections = 8;
  serve();
  std::vector<Wire> streams;
  for (std::uint32_t i = 0; i < 8; ++i) {
    streams.push_back(tcp(1 + i % 2));
    ASSERT_TRUE(streams.back().say(request("GET", "/api/v1/events", tokens[Role::viewer])));
    streams.back().hear("\n\n");
  }
  EXPECT_EQ(ask(tcp(3), health()).status, 200);
  EXPECT_EQ(ask(tcp(3), request("POST", "/api/v1/reset", tokens[Role::operating])).status, 409)
      << "read, and refused by a rule of the station";
}

TEST_F(SeatsOfTheApi, BadTokensOfANeighbourDoNotCostAStop) {
  options.limits.requests_a_second = 0.1;
  options.limits.requests_at_once = 20;
  serve();
  int status = 0;
  for (int i = 0; i < 50 && status != 429; ++i) status = ask(tcp(), request("GET", "/api/v1/health", "guess")).status;
  EXPECT_EQ(status, 429);
  EXPECT_EQ(ask(tcp(), health()).status, 429) << "the address has used up its requests";
  EXPECT_EQ(ask(tcp(), stop()).status, 200);
  EXPECT_EQ(ask(tcp(), request("GET", "/api/v1/status", tokens[Role::viewer])).status, 200);
}

TEST_F(SeatsOfTheApi, BehindTheNamedProxyThePeerIsWhoItForwardsFor) {
  options.limits.requests_a_second = 0.1;
  options.limits.requests_at_once = 1;
  options.proxy = "127.0.0.2";
  serve();
  const auto from = [&](const std::string& client) { return health("X-Forwarded-For: " + client + "\r\n"); };
  auto proxy = tcp(2);
  for (const auto& [client, expected] :
       {std::pair("10.0.0.1", 200), std::pair("10.0.0.1", 429), std::pair("10.0.0.1, 10.0.0.2", 200),
        std::pair("10.0.0.3, 10.0.0.2", 429), std::pair("10.0.0.3\r\nX-Forwarded-For: 10.0.0.2", 429)}) {
    ASSERT_TRUE(proxy.say(from(client)));
    EXPECT_EQ(proxy.answer().status, expected) << client;
  }
  EXPECT_EQ(ask(tcp(3), from("10.0.0.9")).status, 200);
  EXPECT_EQ(ask(tcp(3), from("10.0.0.8")).status, 429) << "only the named proxy is trusted";
}

TEST_F(SeatsOfTheApi, AProxyOnTheSocketHasNoRoleOfItsOwn) {
  const auto* const user = ::getpwuid(::geteuid());
  ASSERT_TRUE(user);
  options.proxy = std::string("unix:") + user->pw_name;
  serve();
  EXPECT_EQ(ask(local(), request("GET", "/api/v1/health")).status, 401);
  EXPECT_EQ(ask(local(), health()).status, 200);
}

TEST_F(SeatsOfTheApi, AProxyThatCannotBeFoundIsNamedAtTheStart) {
  options.proxy = "unix:nobody-of-that-name";
  station.emplace(JobTable{});
  const auto started = ApiServer::start(options, station->loop);
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::not_found);
  EXPECT_THAT(started.error().message, HasSubstr("nobody-of-that-name"));
}

}  // namespace
}  // namespace scanrig
