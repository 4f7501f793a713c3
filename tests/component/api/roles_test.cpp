#include <fmt/format.h>

#include "tests/component/api/api_bench.h"
#include "tests/unit/daemon/api/json_schema.h"

namespace scanrig {
namespace {

using api_bench::Answer;
using api_bench::ApiBench;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// Compares the implementation with its own document.
class Document : public ApiBench {
 protected:
  void SetUp() override {
    ApiBench::SetUp();
    options.limits.requests_a_second = options.limits.requests_at_once = 1e6;
    serve();
    document = ask(local(), request("GET", "/api/v1/openapi.json")).json();
    ASSERT_TRUE(document.is_object());
  }
  /// `path` with good values for its parameters, except that `which` is `value`.
  static std::string fill(std::string path, const std::string& which = "", const std::string& value = "") {
    const std::map<std::string, std::string> good{
        {"id", "old"}, {"file", "model%2Freport.json"}, {"side", "left"}, {"name", "none.js"}, {"number", "1"}};
    for (const auto& [name, text] : good) {
      const auto at = path.find("{" + name + "}");
      if (at != std::string::npos) path.replace(at, name.size() + 2, name == which ? value : text);
    }
    return path;
  }
  static std::string upper(std::string text) {
    for (auto& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
  }
  template <class Check>
  void each_operation(const Check& check) {
    for (const auto& [path, methods] : document["paths"].items()) {
      for (const auto& [method, operation] : methods.items()) {
        SCOPED_TRACE(fmt::format("{} {}", method, path));
        check(upper(method), path, operation);
      }
    }
  }
  /// Status and body are among those the document lists.
  void expect_documented(const json& operation, const Answer& answer) {
    const auto status = std::to_string(answer.status);
    ASSERT_TRUE(operation["responses"].contains(status)) << status << " " << answer.body.substr(0, 200);
    const auto& content = operation["responses"][status]["content"];
    if (!content.contains("application/json")) return;
    EXPECT_TRUE(json_schema::fits(answer.json(), content["application/json"]["schema"], document));
  }
  json document;
};

TEST_F(Document, EveryRouteAndEveryRoleOverTcp) {
  each_operation([&](const std::string& method, const std::string& path, const json& operation) {
    const auto needed = *parse_role(operation["x-role"].get<std::string>());
    const std::string body = operation.contains("requestBody") ? "{}" : "";
    const auto target = fill(path);
    if (!operation.contains("security")) {  // not open to anybody
      EXPECT_EQ(ask(tcp(), request(method, target, "", body)).status, 401) << "no token";
      EXPECT_EQ(ask(tcp(), request(method, target, "scanrig_0", body)).status, 401) << "a bad token";
    }
    for (const Role role : kRoles) {
      const auto answer = ask(tcp(), request(method, target, tokens[role], body));
      if (role < needed) {
        EXPECT_EQ(answer.status, 403) << to_string(role);
      } else {
        EXPECT_NE(answer.status, 401) << to_string(role);
        EXPECT_NE(answer.status, 403) << to_string(role);
      }
      expect_documented(operation, answer);
    }
  });
}

TEST_F(Document, OverTheSocketTheKernelsWordIsEnoughAndABadTokenIsNot) {
  each_operation([&](const std::string& method, const std::string& path, const json& operation) {
    const auto answer = ask(local(), request(method, fill(path)));
    EXPECT_NE(answer.status, 401);
    EXPECT_NE(answer.status, 403);
    expect_documented(operation, answer);
    if (operation.contains("security")) return;  // open to anybody
    EXPECT_EQ(ask(local(), request(method, fill(path), "scanrig_0")).status, 401);
  });
}

TEST_F(Document, NoParameterLeavesItsFolder) {
  each_operation([&](const std::string& method, const std::string& path, const json& operation) {
    for (const auto& parameter : operation.value("parameters", json::array())) {
      if (parameter["in"] != "path") continue;
      for (const auto* bad : {"..", "%2e%2e", "..%2f..%2fsecret", "%2fetc%2fpasswd", "a%00b", "..%5csecret",
                              "a%2f..%2f..%2f..%2fsecret", "%252e%252e%252fsecret", "%c0%ae%c0%ae", "%ff"}) {
        const auto answer = ask(local(), request(method, fill(path, parameter["name"], bad)));
        EXPECT_TRUE(answer.status == 400 || answer.status == 404) << bad << " " << answer.status;
        EXPECT_THAT(answer.body, Not(HasSubstr("do not read"))) << bad;
      }
    }
  });
}

TEST_F(Document, ABodyThatDoesNotFitIsRefused) {
  each_operation([&](const std::string& method, const std::string& path, const json& operation) {
    if (method != "POST") return;
    for (const auto* body :
         {"{", "[]", "null", "\"x\"", "{\"no_such_key\":1}", "{\"a\":1,\"a\":2}", "\xff\xfe", "{}x"}) {
      const auto answer = ask(local(), request(method, fill(path), "", body));
      EXPECT_EQ(answer.status, 400) << body;
      expect_documented(operation, answer);
    }
  });
}

TEST_F(Document, AnOversizedBodyOrHeaderIsRefused) {
  each_operation([&](const std::string& method, const std::string& path, const json& operation) {
    const auto large = ask(local(), request(method, fill(path), "", std::string(100'000, ' ')));
    EXPECT_EQ(large.status, 413);
    expect_documented(operation, large);
    const auto header = ask(local(), request(method, fill(path), "", "", "X-More: " + std::string(9000, 'x') + "\r\n"));
    EXPECT_EQ(header.status, 431);
    expect_documented(operation, header);
  });
}

TEST_F(Document, AModelComesWhole) {
  const auto model = ask(tcp(), request("GET", "/api/v1/jobs/old/model", tokens[Role::viewer]));
  EXPECT_EQ(model.status, 200);
  EXPECT_THAT(model.head, HasSubstr("Content-Type: model/gltf-binary"));
  EXPECT_EQ(model.body, "glTF" + std::string(300'000, 'x'));
}

TEST_F(Document, NoAnswerHoldsAToken) {
  each_operation([&](const std::string& method, const std::string& path, const json&) {
    const auto answer = ask(local(), request(method, fill(path), tokens[Role::engineer]));
    EXPECT_THAT(answer.head + answer.body, Not(HasSubstr(tokens[Role::engineer])));
  });
}

TEST_F(ApiBench, ARevokedTokenIsVoidSoon) {
  serve();
  const auto status = request("GET", "/api/v1/status", tokens[Role::viewer]);
  EXPECT_EQ(ask(tcp(), status).status, 200);
  auto file = TokenFile::read(options.tokens);
  ASSERT_TRUE(file->revoke("viewer") && file->write(options.tokens));
  RealClock clock;
  for (const auto end = Deadline::after(clock, std::chrono::seconds(10)); !end.expired(clock);) {
    if (ask(tcp(), status).status == 401) return;
    clock.sleep_for(std::chrono::milliseconds(200));  // the file is read once a second; stay below the request rate
  }
  FAIL() << "still good";
}

TEST_F(ApiBench, WithoutAPortThereIsNoTcp) {
  options.http_port.reset();
  serve();
  EXPECT_EQ(api->http_port(), 0);
}

TEST_F(ApiBench, AnAddressThatCannotBeHadIsToldAndLeavesNoSocket) {
  station.emplace(JobTable{});
  for (const auto& [address, code] :
       {std::pair("rig", ErrorCode::invalid_input), std::pair("192.0.2.1", ErrorCode::io)}) {
    options.http_address = address;
    const auto started = ApiServer::start(options, station->loop);
    ASSERT_FALSE(started);
    EXPECT_EQ(started.error().code, code);
    EXPECT_FALSE(std::filesystem::exists(options.socket));
  }
}

}  // namespace
}  // namespace scanrig
