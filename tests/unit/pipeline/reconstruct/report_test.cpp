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

}  // namespace
}  // namespace scanrig
