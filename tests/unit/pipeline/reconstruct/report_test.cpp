#include "pipeline/reconstruct/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace scanrig {
namespace {

TEST(Report, NamesItsScanAndTheConfigurationsOfItsViews) {
  Manifest manifest;
  manifest.id = "20261121-093000-1";
  manifest.profile = "p";
  manifest.config_sha256 = {"a", "b"};
  Report made({}, std::nullopt);
  made.add_identity(identity_of(manifest));
  const auto report = made.finished({});
  EXPECT_EQ(report["scan"], "20261121-093000-1");
  EXPECT_EQ(report["profile_sha256"], "p");
  EXPECT_EQ(report["config_sha256"], nlohmann::json::array({"a", "b"}));
}

TEST(Report, NamesEveryImageThatTheOthersContradict) {
  View view;
  view.index = 6;
  const std::vector<Disagreement> found = {
      of_silhouette(0, {.kind = SilhouetteFinding::Kind::region, .view = 6, .camera = 0, .share = 0.031, .views = 3}),
      of_silhouette(1, {.kind = SilhouetteFinding::Kind::surplus, .view = 2, .camera = 1, .share = 0.02}),
      of_motion(0, view, {.view = 6, .views = 3, .mm = 0.051}),
      of_photo(0, 4, 1, {.photo = 9, .share = 0.7, .brightness = 2.5, .is_whole = true})};
  Report report({}, std::nullopt);
  report.add_disagreements(found);
  const auto json = report.finished({})["disagreements"];
  ASSERT_EQ(json.size(), 4U);
  EXPECT_EQ(json[0]["what"], "silhouette");
  EXPECT_EQ(json[0]["camera"], "left");
  EXPECT_EQ(json[0]["view"], 6);
  EXPECT_EQ(json[0]["action"], "part left out");
  EXPECT_EQ(
      json[0]["sentence"],
      "The silhouette of the left camera in view 7 of pose 1 cuts through surface that 3 views measured (3.1 % of "
      "the object): that part is not used.");
  EXPECT_EQ(json[1]["action"], "kept");
  EXPECT_EQ(json[1]["pose"], 1);
  EXPECT_TRUE(json[2]["camera"].is_null());
  EXPECT_EQ(json[2]["sentence"],
            "The object was 0.051 mm out of its place in 3 views of pose 1, from view 7 on: corrected.");
  EXPECT_EQ(json[3]["what"], "photograph");
  EXPECT_EQ(json[3]["camera"], "right");
  EXPECT_EQ(json[3]["action"], "left out");
}

TEST(Report, NamesTheFixtureOfEachPoseThatHasOne) {
  Report report({.fixture = true}, std::nullopt);
  const Fixture fixture{.area_mm2 = 310.0, .height_mm = 12.25, .centre = {1.0, 6.0, -2.0}};
  report.add_fixtures(std::vector<std::optional<Fixture>>{std::nullopt, fixture});
  report.add_disagreements(std::vector{of_fixture(1, fixture, true), of_fixture(1, fixture, false)});
  const auto json = report.finished({});
  EXPECT_EQ(json["options"]["fixture"], true);
  ASSERT_EQ(json["fixtures"].size(), 1U);
  EXPECT_EQ(json["fixtures"][0]["pose"], 1);
  EXPECT_EQ(json["fixtures"][0]["area_mm2"], 310.0);
  EXPECT_EQ(json["fixtures"][0]["height_mm"], 12.25);
  EXPECT_EQ(json["fixtures"][0]["centre_mm"], nlohmann::json::array({1.0, 6.0, -2.0}));
  const std::string sentence = json["disagreements"][0]["sentence"];
  EXPECT_EQ(sentence, "In pose 2 the part stood on a fixture 12.2 mm high, which is left out of the model.");
  EXPECT_EQ(json["disagreements"][1]["sentence"],
            sentence + " Write fixture = true into its recipe: then this is expected.");
}

}  // namespace
}  // namespace scanrig
