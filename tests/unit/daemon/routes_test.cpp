#include "daemon/api/routes.h"

#include <gtest/gtest.h>

#include <future>
#include <nlohmann/json.hpp>
#include <thread>

namespace scanrig {
namespace {

/// A control loop without devices: its rig stops at once, and nothing else ever answers.
class Api : public testing::Test {
 protected:
  Api() {
    auto job = std::make_shared<JobInfo>();
    job->id = "old";
    job->state = JobState::failed;
    job->folder = "/jobs/\xff";
    job->stored = {{0, 3, 135.01, 1, 135.0, 212.0}};
    job->stages = {{"volume", 0.5}};
    job->error = Error{ErrorCode::same_rest, "not turned over"};
    loop_ = std::make_unique<ControlLoop>(clock_, ControlLoopOptions{.rules = {.remote = true, .guard = true}},
                                          JobTable{{"old", std::move(job)}});
    thread_ = std::thread([this] {
      const auto perform = [this](const Action& action) {
        if (std::holds_alternative<action::StopRig>(action)) loop_->post(event::Stopped{});
      };
      EXPECT_TRUE(loop_->run({.perform = perform,
                              .show = [](const PanelOutputs&) {},
                              .fresh_job_id = [] { return std::string("fresh"); }}));
    });
  }
  ~Api() override {
    loop_->post(event::Shutdown{});
    thread_.join();
  }
  std::pair<unsigned, nlohmann::json> ask(const std::string& method, const std::string& target) {
    std::promise<ApiResponse> response;
    answer({method, target}, *loop_, [&](ApiResponse r) { response.set_value(std::move(r)); });
    const auto got = response.get_future().get();
    return {got.status, nlohmann::json::parse(got.body)};
  }
  RealClock clock_;
  std::unique_ptr<ControlLoop> loop_;
  std::thread thread_;
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

TEST_F(Api, JobsAreListedAndOneIsToldInDetail) {
  const auto [status, list] = ask("GET", "/api/v1/jobs");
  EXPECT_EQ(status, 200u);
  ASSERT_EQ(list["jobs"].size(), 1u);
  EXPECT_EQ(list["jobs"][0]["id"], "old");
  const auto [status_of_one, job] = ask("GET", "/api/v1/jobs/old");
  EXPECT_EQ(status_of_one, 200u);
  EXPECT_EQ(job["state"], "failed");
  EXPECT_EQ(job["stored"][0]["measured_deg"], 135.01);
  EXPECT_EQ(job["stored"][0]["redone"], 1);
  EXPECT_NEAR(job["stored"][0]["error_deg"].get<double>(), 0.01, 1e-9);
  EXPECT_EQ(job["stored"][0]["settling_ms"], 212.0);
  EXPECT_EQ(job["stages"][0]["name"], "volume");
  EXPECT_EQ(job["error"]["code"], "same_rest");
}

TEST_F(Api, APressThatIsRefusedSaysWhy) {
  const auto [status, json] = ask("POST", "/api/v1/start");
  EXPECT_EQ(status, 409u);
  EXPECT_EQ(json["error"]["code"], "refused");
}

TEST_F(Api, MaintenanceIsAskedForByNameAndNumbers) {
  EXPECT_EQ(ask("POST", "/api/v1/maintenance/dance").first, 404u);
  EXPECT_EQ(ask("GET", "/api/v1/maintenance/on").first, 405u);
  for (const auto* jog : {"jog", "jog?to_deg=1&by_deg=1", "jog?to_deg=x", "jog?speed_deg_s=1"}) {
    EXPECT_EQ(ask("POST", std::string("/api/v1/maintenance/") + jog).first, 400u) << jog;
  }
  const auto [status, json] = ask("POST", "/api/v1/maintenance/jog?by_deg=-5.5&speed_deg_s=2");
  EXPECT_EQ(status, 409u);
  EXPECT_EQ(json["error"]["code"], "refused");
}

TEST_F(Api, TheInputsAndOutputsOfThePanelAreATable) {
  PanelInputs inputs;
  inputs.flipped = true;
  loop_->post(event::InputsSeen{inputs});
  nlohmann::json io;
  while (!(io = ask("GET", "/api/v1/io").second)["inputs"]["flipped"].get<bool>()) {
  }
  EXPECT_EQ(io["inputs"]["estop_ok"], true);
  EXPECT_EQ(io["outputs"]["lamp_red"], false);
}

TEST_F(Api, AJobThatIsNotThereIsNotFound) {
  const auto [status, json] = ask("GET", "/api/v1/jobs/nothing");
  EXPECT_EQ(status, 404u);
  EXPECT_EQ(json["error"]["code"], "not_found");
}

TEST_F(Api, OtherTargetsAndMethodsAreNotTaken) {
  EXPECT_EQ(ask("GET", "/").first, 404u);
  EXPECT_EQ(ask("GET", "/api/v1/nothing").first, 404u);
  EXPECT_EQ(ask("GET", "/api/v1/start").first, 405u);
  EXPECT_EQ(ask("POST", "/api/v1/status").first, 405u);
}

TEST_F(Api, AResetIsAcceptedOnceTheRigIsSeenStopped) {
  loop_->post(event::PanelFound{true, true});
  loop_->post(event::Stopped{});
  const auto [status, json] = ask("POST", "/api/v1/reset");
  EXPECT_EQ(status, 200u) << json;
  EXPECT_EQ(ask("GET", "/api/v1/status").second["machine"], "Operational.Initialized");
}

}  // namespace
}  // namespace scanrig
