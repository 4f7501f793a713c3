#include <mutex>
#include <thread>

#include "daemon/ctl/client.h"
#include "tests/component/api/api_bench.h"
#include "tests/slowness.h"
#include "web/embedded_files.h"

namespace scanrig {
namespace {

using api_bench::Answer;
using api_bench::ApiBench;
using api_bench::Wire;
using Steady = std::chrono::steady_clock;

/// Each attack is repeated without a pause; meanwhile Stop is served in time, over TCP and over the Unix socket.
class AttacksOnThePage : public ApiBench {
 protected:
  static constexpr int kStops = 15;
  static constexpr int kAttackers = 2;
  static constexpr double kLimitMs = 100.0 * kSlowness;
  static constexpr auto kOwn = "Origin: http://localhost\r\nX-Scanrig: 1\r\n";
  using Attack = std::function<std::string(int number)>;  ///< a request

  void SetUp() override {
    ApiBench::SetUp();
    options.logins = folder_ / "logins.json";
    serve();
  }

  std::string cookie_of(Role role) {
    const auto answer = ask(tcp(), request("POST", "/api/v1/login", "", R"({"token":")" + tokens[role] + "\"}", kOwn));
    EXPECT_EQ(answer.status, 200) << answer.body;
    const auto begin = answer.head.find("Set-Cookie: ") + 12;
    return "Cookie: " + answer.head.substr(begin, answer.head.find(';', begin) - begin) + "\r\n";
  }

  /// The longest Stop, in turns by token over TCP and over the Unix socket.
  double slowest_stop_ms() {
    double slowest = 0.0;
    for (int i = 0; i < kStops; ++i) {
      const auto begun = Steady::now();
      if (i % 2 == 0) {
        EXPECT_EQ(ask(tcp(9), request("POST", "/api/v1/stop", tokens[Role::viewer])).status, 200);
      } else {
        EXPECT_TRUE(ctl::send_request(options.socket, "POST", "/api/v1/stop"));
      }
      slowest = std::max(slowest, std::chrono::duration<double, std::milli>(Steady::now() - begun).count());
    }
    return slowest;
  }

  /// Repeats the attack, at least `count` times and until Stop has been measured; how often each status was the reply.
  std::map<int, int> under(
      const Attack& attack, int count = 100, const std::function<void(const Answer&)>& check = [](const Answer&) {}) {
    std::map<int, int> seen;
    std::mutex mutex;
    std::atomic<int> number = 0;
    std::atomic<bool> measured = false;
    std::vector<std::thread> attackers;
    for (int k = 0; k < kAttackers; ++k) {
      attackers.emplace_back([&, k] {
        while (!measured || number < count) {
          const auto answer = ask(tcp(static_cast<std::uint32_t>(1 + k)), attack(number++));
          const std::lock_guard guard(mutex);
          ++seen[answer.status];
          check(answer);
        }
      });
    }
    EXPECT_LE(slowest_stop_ms(), kLimitMs);
    measured = true;
    for (auto& attacker : attackers) attacker.join();
    EXPECT_LE(slowest_stop_ms(), kLimitMs) << "afterwards";
    return seen;
  }
  static void expect_only(const std::map<int, int>& seen, const std::vector<int>& wanted) {
    for (const auto& [status, count] : seen) EXPECT_THAT(wanted, testing::Contains(status)) << count << " times";
  }
};

TEST_F(AttacksOnThePage, AForgedHostIsMisdirected) {
  expect_only(under([](int) { return std::string("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"); }), {421});
}

TEST_F(AttacksOnThePage, AForgedOriginGivesNoOrder) {
  const auto cookie = cookie_of(Role::engineer);
  const auto attack = [&](int i) {
    const auto* foreign = i % 2 == 0 ? "Origin: http://evil.example\r\nX-Scanrig: 1\r\n" : "Origin: null\r\n";
    return request("POST", "/api/v1/reset", "", "", cookie + foreign);
  };
  expect_only(under(attack), {403, 429});
}

TEST_F(AttacksOnThePage, TheCookieOfARevokedTokenIsVoid) {
  const auto cookie = cookie_of(Role::engineer);
  auto file = *TokenFile::read(options.tokens);
  ASSERT_TRUE(file.revoke("engineer"));
  ASSERT_TRUE(file.write(options.tokens));
  const auto status = [&] { return ask(tcp(), request("GET", "/api/v1/status", "", "", cookie)).status; };
  const auto end = Steady::now() + std::chrono::seconds(5);
  while (status() == 200 && Steady::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  expect_only(under([&](int) { return request("POST", "/api/v1/reset", "", "", cookie + kOwn); }), {401, 429});
}

TEST_F(AttacksOnThePage, NoOtherSiteMayFrameThePage) {
  if (web::embedded_build().empty()) GTEST_SKIP() << "this build has no page";
  const auto check = [](const Answer& answer) {
    EXPECT_THAT(answer.head, testing::HasSubstr("frame-ancestors 'none'"));
  };
  expect_only(under([](int) { return request("GET", "/", "", "", "Sec-Fetch-Dest: iframe\r\n"); }, 100, check), {200});
}

TEST_F(AttacksOnThePage, NoPathLeavesTheAssets) {
  static constexpr std::array<const char*, 6> kPaths{"../secret",   "%2e%2e/secret",    "..%2f..%2fsecret",
                                                     "/etc/passwd", "..%5c..%5csecret", "%00"};
  const auto check = [](const Answer& answer) { EXPECT_EQ(answer.body.find("do not read"), std::string::npos); };
  const auto attack = [](int i) {
    return request("GET", std::string("/assets/") + kPaths[static_cast<std::size_t>(i) % kPaths.size()]);
  };
  expect_only(under(attack, 300, check), {400, 401, 404});
}

TEST_F(AttacksOnThePage, AThousandWrongLoginsAreRefused) {
  const auto attack = [](int i) {
    const std::string guess = i % 2 == 0 ? R"({"code":"AAAAAAAA"})" : R"({"token":"scanrig_0"})";
    return request("POST", "/api/v1/login", "", guess, kOwn);
  };
  const auto seen = under(attack, 1000);
  expect_only(seen, {401, 429});
  EXPECT_LE(seen.at(401), 10 * kAttackers) << "ten a minute from an address";
  EXPECT_GE(seen.at(429), 1000 - 10 * kAttackers);
}

TEST_F(AttacksOnThePage, OversizedCookiesAreRefused) {
  const auto cookie_of_size = [](std::size_t size) {
    return [size](int) {
      return request("GET", "/api/v1/status", "", "", "Cookie: scanrig=" + std::string(size, 'a') + "\r\n");
    };
  };
  expect_only(under(cookie_of_size(7000)), {401, 429});
  // A peer that sends what is too long may be cut off before its reply is read.
  const auto seen = under(cookie_of_size(20'000));
  expect_only(seen, {431, 0});
  EXPECT_TRUE(seen.contains(431));
}

TEST_F(AttacksOnThePage, NoRequestSplitsAReply) {
  const auto cookie = cookie_of(Role::viewer);
  const auto check = [](const Answer& answer) {
    EXPECT_EQ(answer.head.find("injected"), std::string::npos) << answer.head;
  };
  const auto attack = [&](int i) {
    const std::string split = "a%0d%0aSet-Cookie:%20injected=1";
    if (i % 3 == 0) return request("GET", "/api/v1/jobs/" + split, "", "", cookie);
    if (i % 3 == 1) return request("GET", "/api/v1/jobs/old/files/" + split, "", "", cookie);
    return request("POST", "/api/v1/login", "", R"({"code":"a\r\nX: injected"})", kOwn);
  };
  expect_only(under(attack, 300, check), {400, 401, 404, 429});
}

TEST_F(AttacksOnThePage, SlowHeadersFromEightAddressesAndIdleConnectionsHoldUpNobody) {
  std::vector<Wire> slow, idle;
  for (std::uint32_t i = 0; i < 64; ++i) slow.push_back(tcp(1 + i % 8));
  for (std::uint32_t i = 0; i < 300; ++i) idle.push_back(tcp(1 + i % 8));
  std::atomic<bool> measured = false;
  std::thread drip([&] {
    const std::string head = "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nX-Slow: ";
    for (std::size_t at = 0; !measured; ++at) {
      for (const auto& wire : slow) std::ignore = wire.say(std::string(1, at < head.size() ? head[at] : 'x'));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  for (int round = 0; round < 4; ++round) EXPECT_LE(slowest_stop_ms(), kLimitMs);
  measured = true;
  drip.join();
  for (std::size_t i = 0; i < slow.size(); i += 16) EXPECT_TRUE(slow[i].ended()) << "cut off after 5 s at the latest";
}

}  // namespace
}  // namespace scanrig
