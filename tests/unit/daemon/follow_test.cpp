#include "daemon/ctl/job_view.h"

#include <gmock/gmock.h>

#include <cstdio>
#include <nlohmann/json.hpp>

namespace scanrig::ctl {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// Output for a log, not for a terminal.
class Follow : public testing::Test {
 protected:
  ~Follow() override { std::fclose(out); }
  std::string text() {
    std::rewind(out);
    std::string all(100000, '\0');
    all.resize(std::fread(all.data(), 1, all.size(), out));
    return all;
  }
  static json view(int pose, int index, int retakes) {
    const json why = {{"code", "timeout"}, {"message", "left camera: no frame in time"}};
    return {{"pose", pose},
            {"view", index},
            {"measured_deg", 45.01},
            {"retakes", retakes},
            {"retake_reasons", std::vector<json>(static_cast<std::size_t>(retakes), why)}};
  }
  static json job(const std::string& state) {
    return {{"id", "J"},
            {"state", state},
            {"poses", 2},
            {"views", 8},
            {"stored", json::array()},
            {"movement_checks", json::array()},
            {"stages", json::array()},
            {"error", nullptr},
            {"folder", "/j"},
            {"model", "/j/model/model.glb"},
            {"report", "/j/model/report.json"}};
  }
  std::FILE* out = std::tmpfile();
  StageBars bars{out, false};
  JobStory story{bars};
  json status = {{"next_action", "Turn the object over."}};
};

TEST_F(Follow, EachViewIsToldOnce) {
  auto j = job("scanning");
  j["stored"] = {view(0, 0, 0)};
  EXPECT_FALSE(story.tell(status, j));
  j["stored"] = {view(0, 0, 0), view(0, 1, 2)};
  EXPECT_FALSE(story.tell(status, j));
  EXPECT_FALSE(story.tell(status, j));
  EXPECT_EQ(text(),
            "Job J\n"
            "  pose 1/2  view 1/8    45.010 deg  stored\n"
            "  pose 1/2  view 2/8    45.010 deg  stored, 2 exposures retaken\n"
            "      retaken: left camera: no frame in time\n"
            "      retaken: left camera: no frame in time\n");
}

TEST_F(Follow, AMovementCheckIsToldWithWhatWasRedone) {
  auto j = job("scanning");
  const json why = {{"code", "timeout"}, {"message", "left camera: no frame in time"}};
  j["movement_checks"] = {
      {{"pose", 0}, {"shift_px", 0.04}, {"unmoved", true}, {"retakes", 1}, {"retake_reasons", {why}}},
      {{"pose", 1}, {"shift_px", 3.5}, {"unmoved", false}, {"retakes", 0}, {"retake_reasons", json::array()}}};
  for (int i = 0; i < 2; ++i) story.tell(status, j);
  EXPECT_EQ(text(),
            "Job J\n"
            "  pose 1/2  view 1 again  nothing moved, off by 0.04 px, 1 exposure retaken\n"
            "      retaken: left camera: no frame in time\n"
            "  pose 2/2  view 1 again  MOVED, off by 3.50 px\n");
}

TEST_F(Follow, TheFlipIsAskedForOnce) {
  for (int i = 0; i < 3; ++i) story.tell(status, job("waiting_for_flip"));
  EXPECT_EQ(text(), "Job J\n  Turn the object over.\n");
}

TEST_F(Follow, AStageIsOneLineWhenComplete) {
  auto j = job("reconstructing");
  j["stages"] = {{{"name", "volume"}, {"fraction", 0.5}}};
  story.tell(status, j);
  EXPECT_THAT(text(), Not(HasSubstr("volume")));
  j["stages"] = {{{"name", "volume"}, {"fraction", 1.0}}};
  story.tell(status, j);
  story.tell(status, j);
  EXPECT_THAT(text(), HasSubstr("volume                 [##############################] 100 %"));
  EXPECT_EQ(text().find("volume"), text().rfind("volume"));
}

TEST_F(Follow, EndsWithThePathsAndCodeZero) {
  EXPECT_TRUE(story.tell(status, job("done")));
  EXPECT_EQ(story.end(job("done")), ExitCode::ok);
  EXPECT_THAT(text(), HasSubstr("model   /j/model/model.glb"));
  EXPECT_THAT(text(), HasSubstr("report  /j/model/report.json"));
}

TEST_F(Follow, AFailedJobEndsWithTheCodeOfItsError) {
  auto j = job("failed");
  j["error"] = {{"code", "same_rest"}, {"message", "not turned over"}};
  EXPECT_TRUE(story.tell(status, j));
  EXPECT_EQ(story.end(j), ExitCode::no_model);
}

TEST_F(Follow, AModelBeyondTheLimitsIsToldAndEndsWithTheirCode) {
  auto j = job("done");
  j["passed"] = false;
  j["error"] = {{"code", "below_limits"}, {"message", "80 % was measured"}};
  EXPECT_TRUE(story.tell(status, j));
  EXPECT_EQ(story.end(j), ExitCode::below_limits);
  EXPECT_THAT(text(), HasSubstr("model   /j/model/model.glb"));
}

TEST_F(Follow, AJobThatWasNotBegunIsToldWithWhatToDo) {
  EXPECT_FALSE(why_not_started(status, "J"));
  status["not_started"] = {{"job", "J"}, {"why", {{"code", "io"}, {"message", "the disk is full"}}}};
  const auto why = why_not_started(status, "J");
  ASSERT_TRUE(why);
  EXPECT_EQ(why->code, ErrorCode::io);
  EXPECT_EQ(why->message, "job J did not start: the disk is full. Next: Turn the object over.");
  EXPECT_FALSE(why_not_started(status, "another"));
}

TEST_F(Follow, WhatIsWaitedForIsToldWhenItIsAnotherThing) {
  status = {{"cause", "The table is homed."}, {"sentence", "The rig is ready."}, {"next_action", "Press Start."}};
  for (int i = 0; i < 3; ++i) story.wait(status);
  EXPECT_EQ(text(), "Waiting for a job. The table is homed. The rig is ready. Next: Press Start.\n");
}

}  // namespace
}  // namespace scanrig::ctl
