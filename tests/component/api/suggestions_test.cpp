#include "tests/component/api/api_bench.h"
#include "tests/unit/daemon/api/json_schema.h"

namespace scanrig {
namespace {

using api_bench::Answer;
using api_bench::ApiBench;
using nlohmann::json;
using ::testing::HasSubstr;

class SuggestionsOfTheApi : public ApiBench {
 protected:
  Answer get(const std::string& target) { return ask(tcp(), request("GET", "/api/v1" + target, tokens[Role::viewer])); }
  /// The job once it has `count` suggestions.
  json job_with(std::size_t count) {
    json job;
    for (int tries = 0; tries < 1000; ++tries) {
      job = get("/jobs/old").json();
      if (job["suggestions"].size() == count) break;
    }
    return job;
  }
};

TEST_F(SuggestionsOfTheApi, AJobHasThemInTheirOrderAndTheirPictures) {
  std::filesystem::create_directories(folder_ / "jobs/old/live");
  scan_samples::write_text(folder_ / "jobs/old/live/rest1.png", "of the best one");
  serve();
  station->loop.post(event::RestsSuggested{
      "old",
      {{.sentence = "Lay it on its back: shows 81 % of what is unseen.", .gain = 0.81, .has_image = true},
       {.sentence = "Turn it upside down: shows 60 % of what is unseen.", .doubt = "Its pose may not be found."}}});
  const auto job = job_with(2);
  const auto& all = job["suggestions"];
  ASSERT_EQ(all.size(), 2U) << job;
  EXPECT_EQ(all[0]["number"], 1);
  EXPECT_THAT(all[0]["sentence"].get<std::string>(), HasSubstr("on its back"));
  EXPECT_EQ(all[0]["gain"], 0.81);
  EXPECT_EQ(all[0]["image"], true);
  EXPECT_EQ(all[1]["number"], 2);
  EXPECT_EQ(all[1]["image"], false);
  EXPECT_THAT(all[1]["doubt"].get<std::string>(), HasSubstr("may not be found"));
  const auto document = get("/openapi.json").json();
  EXPECT_TRUE(json_schema::fits(job, document["components"]["schemas"]["JobDetail"], document));

  const auto image = get("/jobs/old/suggestions/1");
  EXPECT_EQ(image.status, 200);
  EXPECT_THAT(image.head, HasSubstr("Content-Type: image/png"));
  EXPECT_EQ(image.body, "of the best one");
  EXPECT_EQ(get("/jobs/old/suggestions/2").status, 404) << "not drawn";
  EXPECT_EQ(get("/jobs/old/suggestions/0").status, 400);
  EXPECT_EQ(get("/jobs/none/suggestions/1").status, 404);
}

TEST_F(SuggestionsOfTheApi, TheyAreGoneWithTheReconstruction) {
  serve();
  station->loop.post(event::RestsSuggested{"old", {{.sentence = "Turn it upside down."}}});
  EXPECT_EQ(job_with(1)["suggestions"].size(), 1U);
  station->loop.post(event::RestsSuggested{"old", {}});
  EXPECT_EQ(job_with(0)["suggestions"].size(), 0U);
}

TEST_F(SuggestionsOfTheApi, TheWaysInWhichPose2FitsAreListedWithTheirPictures) {
  serve();
  EXPECT_TRUE(get("/jobs/old").json()["choices"].empty());
  station->loop.post(event::ReconstructionFailed{
      "old", {ErrorCode::ambiguous, "several motions fit"}, false, {{"as it lies", "choices/choice1.png"}, {"over"}}});
  json job;
  for (int tries = 0; tries < 1000 && job["choices"].size() != 2; ++tries) job = get("/jobs/old").json();
  EXPECT_EQ(job["choices"][0], json::parse(R"({"number": 1, "sentence": "as it lies", "image": "choices/choice1.png",
                                               "picked": false})"));
  EXPECT_EQ(job["choices"][1]["image"], "");
  const auto document = get("/openapi.json").json();
  EXPECT_TRUE(json_schema::fits(job, document["components"]["schemas"]["JobDetail"], document));
}

}  // namespace
}  // namespace scanrig
