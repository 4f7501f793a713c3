#include "tests/component/api/api_bench.h"

namespace scanrig {
namespace {

using api_bench::ApiBench;
using std::chrono::milliseconds;

const std::string kStatus = "GET /api/v1/status HTTP/1.1\r\nHost: localhost\r\n\r\n";

class Limits : public ApiBench {
 protected:
  static double seconds_since(std::chrono::steady_clock::time_point begun) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
};

TEST_F(Limits, OneConnectionServesManyRequests) {
  serve();
  auto wire = local();
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(wire.say(kStatus));
    EXPECT_EQ(wire.answer().status, 200);
  }
}

TEST_F(Limits, PipelinedRequestsAreAnsweredInOrder) {
  serve();
  auto wire = local();
  ASSERT_TRUE(wire.say(kStatus + "GET /api/v1/nothing HTTP/1.1\r\nHost: localhost\r\n\r\n" + kStatus));
  EXPECT_EQ(wire.answer().status, 200);
  EXPECT_EQ(wire.answer().status, 404);
  EXPECT_EQ(wire.answer().status, 200);
}

TEST_F(Limits, AHeaderMustBeThereInTimeHoweverItDribbles) {
  options.limits.header_time = milliseconds(300);
  serve();
  auto wire = local();
  const auto begun = std::chrono::steady_clock::now();
  RealClock clock;
  for (int i = 0; i < 100 && wire.say("G"); ++i) clock.sleep_for(milliseconds(20));  // the pace is the subject
  EXPECT_LT(seconds_since(begun), 1.5);
  EXPECT_EQ(ask(local(), kStatus).status, 200);
}

TEST_F(Limits, ABodyMustBeThereInTimeToo) {
  options.limits.body_time = milliseconds(200);
  serve();
  auto wire = local();
  ASSERT_TRUE(wire.say("POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{"));
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_TRUE(wire.ended());
  EXPECT_LT(seconds_since(begun), 2.0);
}

TEST_F(Limits, WhoDoesNotReadItsAnswerIsCutOff) {
  options.limits.answer_time = milliseconds(200);
  options.limits.slowest_bytes_a_second = 1e9;
  serve();
  std::string model;
  model.resize(20'000'000, 'x');
  scan_samples::write_text(folder_ / "jobs/old/model/model.glb", model);
  auto wire = local();
  ASSERT_TRUE(wire.say("GET /api/v1/jobs/old/model HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  RealClock clock;
  const auto connections = [&] {
    const auto health =
        ask(local(), "GET /api/v1/health HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").json();
    return health.is_object() ? health.value("connections", 0) : 0;
  };
  for (const auto end = Deadline::after(clock, std::chrono::seconds(5)); !end.expired(clock);
       clock.sleep_for(milliseconds(20))) {
    if (connections() == 1) return;
  }
  FAIL() << "it still has its place";
}

TEST_F(Limits, TooManyRequestsAreToldSo) {
  options.limits.requests_a_second = 0.1;
  options.limits.requests_at_once = 3;
  serve();
  for (const char* const path : {"/api/v1/health", "/api/v1/status"}) {
    auto wire = local();
    for (const int expected : {200, 200, 200, 429}) {
      ASSERT_TRUE(wire.say(request("GET", path)));
      EXPECT_EQ(wire.answer().status, expected) << path;
    }
  }
}

TEST_F(Limits, WhatIsNotHttpIsToldSoAndHungUp) {
  serve();
  for (const std::string& noise :
       {std::string("hello\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"), std::string("\x16\x03\x01\x02\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost : x\r\n\r\n"),
        std::string("POST /api/v1/stop HTTP/1.1\r\nContent-Length: x\r\n\r\n")}) {
    auto wire = local();
    ASSERT_TRUE(wire.say(noise));
    EXPECT_EQ(wire.answer().status, 400) << noise;
    EXPECT_TRUE(wire.ended());
  }
  EXPECT_EQ(ask(local(), kStatus).status, 200);
}

TEST_F(Limits, AControlLoopThatDoesNotAnswerIsGivenUp) {
  options.limits.answer_time = milliseconds(100);
  serve();
  station->end();
  auto wire = local();
  ASSERT_TRUE(wire.say("POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  const auto answer = wire.answer();
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(answer.json()["error"]["code"], "timeout");
  EXPECT_EQ(ask(local(), kStatus).status, 200) << "what is known can still be read";
}

}  // namespace
}  // namespace scanrig
