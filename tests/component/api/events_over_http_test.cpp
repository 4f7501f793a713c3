#include "tests/component/api/api_bench.h"

namespace scanrig {
namespace {

using api_bench::ApiBench;
using api_bench::Wire;
using testing::AllOf;
using testing::HasSubstr;

class EventsOverHttp : public ApiBench {
 protected:
  Wire listen(const std::string& last_event_id = "") {
    auto wire = local();
    EXPECT_TRUE(wire.say(request("GET", "/api/v1/events", "", "",
                                 last_event_id.empty() ? "" : "Last-Event-ID: " + last_event_id + "\r\n")));
    EXPECT_THAT(wire.hear("\r\n\r\n"), AllOf(HasSubstr("200 OK"), HasSubstr("Content-Type: text/event-stream")));
    return wire;
  }
  /// The next event of that kind; a status may be reported in more steps than one.
  static std::string hear_of(Wire& wire, const std::string& kind, const std::string& words) {
    std::string event;
    for (int i = 0; i < 10; ++i) {
      event = wire.hear("\n\n");
      if (event.find("event: " + kind + "\n") != std::string::npos && event.find(words) != std::string::npos) break;
    }
    return event;
  }
  static std::string id_of(const std::string& event) { return event.substr(4, event.find('\n') - 4); }
};

TEST_F(EventsOverHttp, BeginWithThePresentStatusAndGoOnWithWhatChanges) {
  serve();
  auto wire = listen();
  EXPECT_THAT(wire.hear("\n\n"), AllOf(HasSubstr("event: status\n"), HasSubstr("Preoperational")));
  station->loop.post(event::PanelFound{true, true});
  EXPECT_THAT(hear_of(wire, "status", "Halted"), HasSubstr("Halted"));
  station->loop.post(event::StageProgress{"old", "volume", 0.9});
  EXPECT_THAT(hear_of(wire, "job", "0.9"), HasSubstr("0.9"));
}

TEST_F(EventsOverHttp, AClientThatWasCutOffGetsWhatItMissed) {
  serve();
  std::string id;
  {
    auto wire = listen();
    id = id_of(wire.hear("\n\n"));
  }
  station->loop.post(event::StageProgress{"old", "volume", 0.7});
  auto watcher = listen();
  watcher.hear("\n\n");
  EXPECT_THAT(listen(id).hear("\n\n"), AllOf(HasSubstr("event: job\n"), HasSubstr("0.7")));
  EXPECT_THAT(listen("other-1").hear("\n\n"), HasSubstr("event: lost\n"));
}

TEST_F(EventsOverHttp, AHeartbeatTellsThatTheStreamIsAlive) {
  options.limits.heartbeat = std::chrono::milliseconds(50);
  serve();
  auto wire = listen();
  wire.hear("\n\n");
  EXPECT_EQ(wire.hear("\n\n"), ":\n\n");
  EXPECT_EQ(wire.hear("\n\n"), ":\n\n");
}

TEST_F(EventsOverHttp, WhoLosesItsTokenLosesItsStream) {
  options.limits.heartbeat = std::chrono::milliseconds(50);
  serve();
  auto wire = tcp();
  ASSERT_TRUE(wire.say(request("GET", "/api/v1/events", tokens[Role::viewer])));
  EXPECT_THAT(wire.hear("\r\n\r\n"), HasSubstr("200 OK"));
  ASSERT_TRUE(TokenFile().write(options.tokens));
  RealClock clock;
  const auto end = Deadline::after(clock, std::chrono::seconds(5));
  while (!end.expired(clock) && wire.hear("\n\n").ends_with("\n\n")) {
  }
  EXPECT_FALSE(end.expired(clock));
}

TEST_F(EventsOverHttp, OneWhoDoesNotListenHoldsUpNobody) {
  serve();
  auto deaf = listen();
  auto wire = listen();
  wire.hear("\n\n");
  for (int i = 1; i <= 50; ++i) station->loop.post(event::StageProgress{"old", "stage " + std::to_string(i), 0.5});
  std::string last;
  while (last.find("stage 50") == std::string::npos) {
    last = wire.hear("\n\n");
    ASSERT_FALSE(last.empty());
  }
}

}  // namespace
}  // namespace scanrig
