#include "daemon/api/route.h"

#include <gmock/gmock.h>

#include "tests/unit/daemon/api/station_without_rig.h"

namespace scanrig {
namespace {

using testing::HasSubstr;

class Api : public testing::Test {
 protected:
  static JobTable jobs() {
    auto all = one_job("old", "/jobs/\xff");
    for (const auto* id : {"a", "b", "c"}) {
      all[id] = std::make_shared<JobInfo>(JobInfo{.id = id, .state = JobState::done});
    }
    return all;
  }
  std::pair<unsigned, nlohmann::json> ask(const std::string& method, const std::string& target,
                                          const std::string& body = "", std::optional<Role> role = Role::engineer) {
    auto match = router.find(method, target, role);
    if (!match) return read(match.error());
    std::promise<ApiResponse> response;
    Router::call(std::move(*match), body, {station.loop, [] { return ServiceStatus{.uptime_s = 5.0}; }},
                 [&](ApiResponse r) { response.set_value(std::move(r)); });
    return read(response.get_future().get());
  }
  static std::pair<unsigned, nlohmann::json> read(const ApiResponse& response) {
    return {response.status, nlohmann::json::parse(std::get<std::string>(response.body))};
  }
  std::vector<std::string> page(const std::string& query) {
    std::vector<std::string> ids;
    const auto answer = ask("GET", "/api/v1/jobs" + query).second;
    for (const auto& job : answer["jobs"]) ids.push_back(job["id"]);
    return ids;
  }
  const Router router;
  StationWithoutRig station{jobs()};
};

TEST_F(Api, StatusSaysStateCauseSentenceAndNextAction) {
  const auto [status, json] = ask("GET", "/api/v1/status");
  EXPECT_EQ(status, 200u);
  EXPECT_EQ(json["machine"], "Preoperational");
  EXPECT_EQ(json["activity"], "none");
  EXPECT_FALSE(json["sentence"].get<std::string>().empty());
  EXPECT_TRUE(json.contains("cause") && json.contains("next_action"));
  EXPECT_TRUE(json["job"].is_null());
}

TEST_F(Api, JobsComeNewestFirstAPageAtATime) {
  using testing::ElementsAre;
  EXPECT_THAT(page(""), ElementsAre("old", "c", "b", "a"));
  EXPECT_THAT(page("?limit=2"), ElementsAre("old", "c"));
  EXPECT_EQ(ask("GET", "/api/v1/jobs?limit=2").second["next"], "c");
  EXPECT_THAT(page("?limit=2&before=c"), ElementsAre("b", "a"));
  EXPECT_TRUE(ask("GET", "/api/v1/jobs?limit=2&before=c").second["next"].is_null());
  EXPECT_THAT(page("?state=failed"), ElementsAre("old"));
  for (const auto* query : {"?limit=0", "?limit=501", "?limit=x", "?state=lost", "?before=", "?other=1"}) {
    EXPECT_EQ(ask("GET", std::string("/api/v1/jobs") + query).first, 400u) << query;
  }
}

TEST_F(Api, OneJobIsToldInDetail) {
  const auto [status, job] = ask("GET", "/api/v1/jobs/old");
  EXPECT_EQ(status, 200u);
  EXPECT_EQ(job["state"], "failed");
  EXPECT_EQ(job["stored"][0]["measured_deg"], 135.01);
  EXPECT_EQ(job["stored"][0]["retakes"], 1);
  EXPECT_EQ(job["stored"][0]["retake_reasons"][0]["code"], "timeout");
  EXPECT_EQ(job["stored"][0]["retake_reasons"][0]["message"], "left camera: no frame in time");
  EXPECT_NEAR(job["stored"][0]["error_deg"].get<double>(), 0.01, 1e-9);
  EXPECT_EQ(job["stored"][0]["settling_ms"], 212.0);
  EXPECT_EQ(job["movement_checks"][0]["retakes"], 1);
  EXPECT_EQ(job["movement_checks"][0]["retake_reasons"][0]["message"], "right camera: torn");
  EXPECT_EQ(job["stages"][0]["name"], "volume");
  EXPECT_EQ(job["error"]["code"], "same_rest");
}

TEST_F(Api, APressThatIsRefusedSaysWhy) {
  const auto [status, json] = ask("POST", "/api/v1/start");
  EXPECT_EQ(status, 409u);
  EXPECT_EQ(json["error"]["code"], "refused");
}

TEST_F(Api, AResetIsAcceptedOnceTheRigIsSeenStopped) {
  station.loop.post(event::PanelFound{true, true});
  station.loop.post(event::Stopped{});
  const auto [status, json] = ask("POST", "/api/v1/reset");
  EXPECT_EQ(status, 200u) << json;
  EXPECT_EQ(ask("GET", "/api/v1/status").second["machine"], "Operational.Initialized");
}

TEST_F(Api, AJogTakesOneAngle) {
  EXPECT_EQ(ask("POST", "/api/v1/maintenance/dance").first, 404u);
  for (const auto* body : {"", R"({"to_deg":1,"by_deg":1})", R"({"to_deg":"x"})", R"({"speed_deg_s":1})"}) {
    EXPECT_EQ(ask("POST", "/api/v1/maintenance/jog", body).first, 400u) << body;
  }
  const auto [status, json] = ask("POST", "/api/v1/maintenance/jog", R"({"by_deg":-5.5,"speed_deg_s":2})");
  EXPECT_EQ(status, 409u);
  EXPECT_EQ(json["error"]["code"], "refused");
}

TEST_F(Api, TheInputsAndOutputsOfThePanelAreATable) {
  PanelInputs inputs;
  inputs.flipped = true;
  station.loop.post(event::InputsRead{inputs});
  nlohmann::json io;
  while (!(io = ask("GET", "/api/v1/io").second)["inputs"]["flipped"].get<bool>()) {
  }
  EXPECT_EQ(io["inputs"]["estop_ok"], true);
  EXPECT_EQ(io["outputs"]["lamp_red"], false);
}

TEST_F(Api, WhatIsNotThereIsNotFound) {
  for (const auto* target :
       {"/api/v1/jobs/nothing", "/nothing", "/assets/nothing.js", "/api/v1/nothing", "/api/v1/status/x", "/api/v1"}) {
    const auto [status, json] = ask("GET", target);
    EXPECT_EQ(status, 404u) << target;
    EXPECT_EQ(json["error"]["code"], "not_found");
  }
}

TEST_F(Api, OnlyAJobsOwnNameReachesTheDisk) {
  for (const auto* id : {"old%2Fmodel", "nothing", "old%2F..%2Fa", ".."}) {
    const auto job = std::string("/api/v1/jobs/") + id;
    for (const auto& [method, target] : {std::pair("DELETE", job), std::pair("GET", job + "/bundle"),
                                         std::pair("POST", job + "/cancel"), std::pair("POST", job + "/reprocess")}) {
      const auto status = ask(method, target).first;
      EXPECT_TRUE(status == 404 || status == 400) << method << " " << target << " " << status;
    }
  }
}

TEST_F(Api, AnotherMethodIsNotTaken) {
  EXPECT_EQ(ask("GET", "/api/v1/start").first, 405u);
  EXPECT_EQ(ask("POST", "/api/v1/status").first, 405u);
  EXPECT_EQ(ask("BREW", "/api/v1/status").first, 405u);
}

TEST_F(Api, ABodyIsForRoutesThatTakeOne) {
  EXPECT_EQ(ask("POST", "/api/v1/stop", R"({"now":true})").first, 400u);
  EXPECT_EQ(ask("POST", "/api/v1/stop", "{}").first, 200u) << "stop is never refused";
}

TEST_F(Api, NobodyLearnsNothingNotEvenWhatIsThere) {
  for (const auto* target : {"/api/v1/status", "/api/v1/nothing", "//", "/api/v1/openapi.json", "/metrics"}) {
    const auto [status, json] = ask("GET", target, "", std::nullopt);
    EXPECT_EQ(status, 401u) << target;
    EXPECT_EQ(json["error"]["code"], "refused");
  }
}

TEST_F(Api, TooLowARoleIsToldWhichIsNeeded) {
  const auto [status, json] = ask("POST", "/api/v1/start", "", Role::viewer);
  EXPECT_EQ(status, 403u);
  EXPECT_THAT(json["error"]["message"].get<std::string>(), HasSubstr("operator"));
  EXPECT_EQ(ask("POST", "/api/v1/maintenance/on", "", Role::operating).first, 403u);
  EXPECT_EQ(ask("POST", "/api/v1/stop", "", Role::viewer).first, 200u) << "any role may stop";
}

TEST_F(Api, HealthNamesACalibrationThatRefuses) {
  station.loop.post(event::CalibrationChecked{.problem = Error{ErrorCode::not_found, "there is no calibration"}});
  nlohmann::json health;
  while ((health = ask("GET", "/api/v1/health").second)["ok"] == true) {
  }
  EXPECT_EQ(health["problems"][0]["code"], "not_found");
  EXPECT_EQ(health["problems"][0]["message"], "there is no calibration");
}

TEST_F(Api, HealthNamesEveryProblem) {
  station.loop.post(event::DevicesChecked{{{"camera", Error{ErrorCode::timeout, "no reply"}}}});
  nlohmann::json health;
  while ((health = ask("GET", "/api/v1/health").second)["devices"].size() < 2) {
  }
  EXPECT_EQ(health["ok"], false);
  EXPECT_EQ(health["problems"][0]["message"], "no reply");
  EXPECT_EQ(health["uptime_s"], 5.0);
}

}  // namespace
}  // namespace scanrig
