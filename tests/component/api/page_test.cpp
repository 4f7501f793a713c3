#include "core/files.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/logins.h"
#include "tests/component/api/api_bench.h"
#include "web/embedded_files.h"

namespace scanrig {
namespace {

using api_bench::Answer;
using api_bench::ApiBench;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// A browser: sends its cookie, and from the rig's own page the right Origin and X-Scanrig.
class PageTest : public ApiBench {
 protected:
  static constexpr auto kOwn = "Origin: http://localhost\r\nX-Scanrig: 1\r\n";

  void SetUp() override {
    ApiBench::SetUp();
    options.logins = folder_ / "logins.json";
  }
  Answer browse(const std::string& method, const std::string& target, const std::string& more = "",
                const std::string& body = "") {
    return ask(tcp(), request(method, target, "", body, more));
  }
  Answer log_in(const std::string& body) { return browse("POST", "/api/v1/login", kOwn, body); }
  /// The header line that sends the cookie of a login with the token of `role`.
  std::string cookie_of(Role role) {
    const auto answer = log_in(R"({"token":")" + tokens[role] + "\"}");
    EXPECT_EQ(answer.status, 200) << answer.body;
    const auto begin = answer.head.find("Set-Cookie: ") + 12;
    return "Cookie: " + answer.head.substr(begin, answer.head.find(';', begin) - begin) + "\r\n";
  }
};

TEST_F(PageTest, ThePageIsOpenToAnybodyAndRunsNothingButItself) {
  serve();
  const auto page = browse("GET", "/");
  if (web::embedded_build().empty()) {
    EXPECT_EQ(page.status, 404);
    return;
  }
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.head, AllOf(HasSubstr("Content-Encoding: gzip"), HasSubstr("script-src 'self'"),
                               HasSubstr("frame-ancestors 'none'"), HasSubstr("Cache-Control: no-cache")));
  const auto tag = "If-None-Match: \"" + std::string(web::embedded_build()) + "\"\r\n";
  EXPECT_EQ(browse("GET", "/", tag).status, 304) << "not sent again";
  for (const auto* path : {"/assets/none.js", "/assets/..%2F..%2Fsecret", "/assets/%2e%2e%2fsecret", "/assets/a%2fb"}) {
    EXPECT_THAT(browse("GET", path).status, testing::AnyOf(400, 401, 404)) << path;
  }
}

TEST_F(PageTest, AFileIsSentInPartsAndNotAgainWhenItIsKnown) {
  serve();
  const auto cookie = cookie_of(Role::viewer);
  const std::string model = "/api/v1/jobs/old/model";
  const auto whole = browse("GET", model, cookie);
  ASSERT_EQ(whole.status, 200);
  ASSERT_EQ(whole.body.size(), 300'004U);
  const auto tag_at = whole.head.find("ETag: ") + 6;
  const auto tag = whole.head.substr(tag_at, whole.head.find('\r', tag_at) - tag_at);
  const auto part = browse("GET", model, cookie + "Range: bytes=0-5\r\n");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, "glTFxx");
  EXPECT_THAT(part.head, HasSubstr("Content-Range: bytes 0-5/300004"));
  EXPECT_EQ(browse("GET", model, cookie + "Range: bytes=300000-\r\nIf-Range: " + tag + "\r\n").body, "xxxx");
  EXPECT_EQ(browse("GET", model, cookie + "Range: bytes=0-5\r\nIf-Range: \"another\"\r\n").status, 200);
  const auto behind = browse("GET", model, cookie + "Range: bytes=300004-\r\n");
  EXPECT_EQ(behind.status, 416);
  EXPECT_THAT(behind.head, HasSubstr("Content-Range: bytes */300004"));
  EXPECT_EQ(browse("GET", model, cookie + "If-None-Match: " + tag + "\r\n").status, 304);
  EXPECT_EQ(browse("GET", model, cookie + "If-None-Match: \"another\"\r\n").status, 200);
}

TEST_F(PageTest, HeadIsAnsweredAsGetWithoutABody) {
  serve();
  const auto cookie = cookie_of(Role::viewer);
  auto wire = tcp();
  for (const auto* path : {"/api/v1/jobs/old/model", "/api/v1/status", "/api/v1/nothing"}) {
    ASSERT_TRUE(wire.say(request("HEAD", path, "", "", cookie)));
    const auto head = wire.hear("\r\n\r\n");
    EXPECT_THAT(head, HasSubstr(path == std::string("/api/v1/nothing") ? " 404 " : " 200 "));
    EXPECT_THAT(head, Not(HasSubstr("Content-Length: 0\r\n")));
    ASSERT_TRUE(wire.say(request("GET", "/api/v1/login", "", "", cookie)));
    EXPECT_EQ(wire.answer().json()["role"], "viewer") << "no byte of a body is left over after " << path;
  }
  ASSERT_TRUE(wire.say(request("HEAD", "/api/v1/jobs/old/bundle", tokens[Role::operating])));
  EXPECT_THAT(wire.hear("\r\n\r\n"), HasSubstr(" 405 ")) << "packing marks the job as exported";
  EXPECT_THAT(browse("HEAD", "/api/v1/events", cookie).head, HasSubstr("text/event-stream"));
}

TEST_F(PageTest, AnEngineerReadsTheNewestLinesOfTheLog) {
  RecentLog log;
  options.log = &log;
  serve();
  for (int i = 1; i <= 3; ++i) {
    log.write({.priority = Priority::warning, .message = fmt::format("line {}", i), .job = "old", .device = "panel"});
  }
  EXPECT_EQ(browse("GET", "/api/v1/log", cookie_of(Role::operating)).status, 403);
  const auto cookie = cookie_of(Role::engineer);
  const auto all = browse("GET", "/api/v1/log", cookie).json()["lines"];
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0]["message"], "line 1");
  EXPECT_EQ(all[0]["priority"], "warning");
  EXPECT_EQ(all[0]["job"], "old");
  EXPECT_EQ(all[0]["device"], "panel");
  EXPECT_EQ(browse("GET", "/api/v1/log?after=2", cookie).json()["lines"][0]["message"], "line 3");
  EXPECT_EQ(browse("GET", "/api/v1/log?after=3", cookie).json()["lines"].size(), 0U);
  EXPECT_EQ(browse("GET", "/api/v1/log?after=900", cookie).json()["lines"].size(), 3U) << "a number of an earlier run";
  for (std::size_t i = 0; i < RecentLog::kLines; ++i) log.write({.message = "more"});
  EXPECT_EQ(browse("GET", "/api/v1/log", cookie).json()["lines"][0]["message"], "more") << "the oldest go";
}

TEST_F(PageTest, TheDoctorsLastReportIsShownAndADamagedOneIsNone) {
  serve();
  const auto cookie = cookie_of(Role::viewer);
  const auto told = [&] { return browse("GET", "/api/v1/doctor", cookie).json(); };
  const nlohmann::json none{{"time", nullptr}, {"findings", nlohmann::json::array()}};
  EXPECT_EQ(told(), none);
  const auto file = folder_ / kDoctorFile;
  const nlohmann::json finding{{"id", "no_light"}, {"problem", "It is dark."}, {"remedy", "Check the lamp."}};
  const nlohmann::json report{
      {"time", "2026-11-26T07:00:00Z"}, {"sections", {"any"}}, {"findings", {finding, "no finding", {{"id", 5}}}}};
  ASSERT_TRUE(write_file_atomically(file, report.dump()));
  EXPECT_EQ(told()["time"], "2026-11-26T07:00:00Z");
  EXPECT_EQ(told()["findings"], nlohmann::json::array({finding}));
  for (const char* damaged : {"", "{", "[]", "{\"time\": 5}", "\xff"}) {
    ASSERT_TRUE(write_file_atomically(file, std::string_view(damaged)));
    EXPECT_EQ(told(), none) << damaged;
  }
}

TEST_F(PageTest, TheLastOrderThatWasObeyedIsNamedToEverybody) {
  serve();
  const auto cookie = cookie_of(Role::viewer);
  const auto last = [&] { return browse("GET", "/api/v1/status", cookie).json()["last_order"]; };
  EXPECT_EQ(last(), nullptr);
  EXPECT_EQ(browse("POST", "/api/v1/stop", cookie + kOwn).status, 200);
  EXPECT_EQ(last()["what"], "stop");
  EXPECT_EQ(last()["who"], "viewer") << "the name of the token";
  const auto when = last()["when"];
  EXPECT_EQ(browse("POST", "/api/v1/start", cookie_of(Role::operating) + kOwn, "{}").status, 409);
  EXPECT_EQ(last()["what"], "stop") << "what is refused is no order";
  EXPECT_EQ(ask(local(), request("POST", "/api/v1/stop")).status, 200);
  EXPECT_EQ(last()["who"], fmt::format("user {}", ::getuid()));
  EXPECT_GE(last()["when"], when);
  station->loop.post(event::Pressed{Button::stop, Origin::panel, {}});
  const auto shown = [&] { return browse("GET", "/api/v1/snapshot", cookie).json()["status"]["last_order"]["who"]; };
  for (int i = 0; i < 100 && shown() != "panel"; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(shown(), "panel");
  EXPECT_EQ(last()["who"], "panel");
}

TEST_F(PageTest, RecipesAreListedWithTheirViews) {
  serve();
  const auto recipes = browse("GET", "/api/v1/recipes", cookie_of(Role::viewer)).json()["recipes"];
  ASSERT_GE(recipes.size(), 1U);
  EXPECT_EQ(recipes[0]["name"], "default");
  EXPECT_GT(recipes[0]["views"], 0);
}

TEST_F(PageTest, ASnapshotAndTheEventsAfterItAreOneStory) {
  serve();
  const auto cookie = cookie_of(Role::viewer);
  const auto page = browse("GET", "/api/v1/snapshot", cookie).json();
  EXPECT_EQ(page["status"]["machine"], "Preoperational");
  EXPECT_EQ(page["jobs"][0]["id"], "old");
  EXPECT_EQ(page["login"]["role"], "viewer");
  EXPECT_EQ(page["login"]["name"], "viewer");
  EXPECT_FALSE(page["insecure"]);
  auto wire = tcp();
  const auto after = page["life"].get<std::string>() + "-" + std::to_string(page["seq"].get<int>());
  EXPECT_TRUE(wire.say(request("GET", "/api/v1/events?after=" + after, "", "", cookie)));
  EXPECT_THAT(wire.hear("\r\n\r\n"), HasSubstr("200 OK"));
  EXPECT_THAT(wire.hear("\n\n"), AllOf(HasSubstr("event: beat\n"), HasSubstr("\"seq\":"), Not(HasSubstr("id:"))));
  station->loop.post(event::StageProgress{"old", "volume", 0.9});
  EXPECT_THAT(wire.hear("\n\n") + wire.hear("\n\n"), HasSubstr("event: job\n"));
}

TEST_F(PageTest, ACookieIsForThisSiteAndNoScript) {
  serve();
  const auto answer = log_in(R"({"token":")" + tokens[Role::operating] + "\"}");
  EXPECT_THAT(answer.head, ContainsRegex("Set-Cookie: scanrig=[0-9a-f]{64}; Path=/; HttpOnly; SameSite=Strict"));
  EXPECT_EQ(answer.json()["role"], "operator");
}

TEST_F(PageTest, BehindTlsTheCookieIsForThisHostAlone) {
  options.http_origin = "https://rig.example";
  serve();
  EXPECT_THAT(log_in(R"({"token":")" + tokens[Role::viewer] + "\"}").head,
              AllOf(HasSubstr("Set-Cookie: __Host-scanrig="), HasSubstr("; Secure")));
}

TEST_F(PageTest, AnOrderByCookieNeedsTheRigsOwnPage) {
  serve();
  const auto cookie = cookie_of(Role::operating);
  for (const auto* foreign : {"", "X-Scanrig: 1\r\n", "Origin: http://localhost\r\n",
                              "Origin: http://evil.example\r\nX-Scanrig: 1\r\n", "Origin: null\r\nX-Scanrig: 1\r\n"}) {
    EXPECT_EQ(browse("POST", "/api/v1/start", cookie + foreign).status, 403) << foreign;
    EXPECT_EQ(browse("POST", "/api/v1/stop", cookie + foreign).status, 403) << foreign;
  }
  EXPECT_EQ(browse("POST", "/api/v1/stop", cookie + kOwn).status, 200);
  EXPECT_EQ(browse("POST", "/api/v1/start", cookie + kOwn).status, 409) << "obeyed or refused by the station";
  EXPECT_EQ(browse("GET", "/api/v1/status", cookie).status, 200);
}

TEST_F(PageTest, AnotherSitesFormLogsNobodyIn) {
  serve();
  const auto body = R"({"token":")" + tokens[Role::viewer] + "\"}";
  EXPECT_EQ(browse("POST", "/api/v1/login", "Origin: http://evil.example\r\n", body).status, 403);
}

TEST_F(PageTest, ARequestUnderAForeignNameIsNotServed) {
  serve();
  auto wire = tcp();
  EXPECT_TRUE(wire.say("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"));
  const auto answer = wire.answer();
  EXPECT_EQ(answer.status, 421);
  EXPECT_THAT(answer.json()["error"]["message"].get<std::string>(), HasSubstr("not a name of the rig"));
}

TEST_F(PageTest, TheRoleOfACookieIsThatOfItsTokenAndEndsWithIt) {
  serve();
  const auto viewer = cookie_of(Role::viewer), engineer = cookie_of(Role::engineer);
  EXPECT_EQ(browse("POST", "/api/v1/start", viewer + kOwn).status, 403);
  EXPECT_NE(browse("POST", "/api/v1/maintenance/off", engineer + kOwn).status, 403);
  EXPECT_EQ(browse("DELETE", "/api/v1/login", viewer + kOwn).status, 200);
  EXPECT_EQ(browse("GET", "/api/v1/status", viewer).status, 401);
  EXPECT_EQ(browse("GET", "/api/v1/status", engineer).status, 200);
  auto file = *TokenFile::read(options.tokens);
  ASSERT_TRUE(file.revoke("engineer"));
  ASSERT_TRUE(file.write(options.tokens));
  int status = 200;
  for (int i = 0; i < 50 && status == 200; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    status = browse("GET", "/api/v1/status", engineer).status;
  }
  EXPECT_EQ(status, 401);
}

TEST_F(PageTest, ACodeOfTheSocketLogsABrowserInOnce) {
  serve();
  const auto offered = ask(local(), request("POST", "/api/v1/login/code", "", R"({"role":"operator","kiosk":true})"));
  ASSERT_EQ(offered.status, 200) << offered.body;
  const auto body = R"({"code":")" + offered.json()["code"].get<std::string>() + "\"}";
  const auto first = log_in(body);
  EXPECT_EQ(first.status, 200);
  EXPECT_EQ(first.json()["role"], "operator");
  EXPECT_EQ(log_in(body).status, 401);
}

TEST_F(PageTest, GuessesAreLimited) {
  serve();
  std::map<int, int> seen;
  for (int i = 0; i < 1000; ++i) ++seen[log_in(R"({"code":"AAAAAAAA"})").status];
  EXPECT_EQ(seen[401], 10);
  EXPECT_EQ(seen[429], 990);
  EXPECT_EQ(ask(tcp(), request("POST", "/api/v1/stop", tokens[Role::viewer])).status, 200)
      << "Stop has its own allowance";
}

}  // namespace
}  // namespace scanrig
