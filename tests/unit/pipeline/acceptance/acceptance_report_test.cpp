#include "pipeline/acceptance/report/acceptance_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/pipeline/acceptance/artefact_mesh.h"
#include "tests/unit/pipeline/calibrate/well_formed.h"

namespace scanrig::acceptance {
namespace {

using testing::HasSubstr;
using testing::Not;

const Artefact kCalibratedSphere{.kind = Kind::sphere, .diameter_mm = 25.0, .expanded_uncertainty_mm = 0.001};

AcceptanceReport report_of(const std::vector<double>& radii, const Limits& limits) {
  AcceptanceReport report{.artefact = kCalibratedSphere, .date = "2026-11-26T10:00:00Z", .measurements = {}};
  for (const double radius : radii) {
    auto found = measure(artefact_mesh::ball_on_stem(radius), kCalibratedSphere, limits);
    EXPECT_TRUE(found) << found.error().message;
    if (found) report.measurements.push_back({fmt::format("<scan {}>", report.measurements.size()), *found});
  }
  return report;
}

TEST(AcceptanceReportTest, ALimitIsPassedMissedOrWithinTheUncertainty) {
  const auto verdicts = [](double value, double u, double limit) {
    const AcceptanceResult result{.value_mm = value, .expanded_uncertainty_mm = u, .limit_mm = limit};
    return verdict_words(result);
  };
  EXPECT_EQ(verdicts(0.010, 0.002, 0.020), "pass");
  EXPECT_EQ(verdicts(-0.019, 0.002, 0.020), "pass, within U of the limit");
  EXPECT_EQ(verdicts(-0.021, 0.002, 0.020), "fail, within U of the limit");
  EXPECT_EQ(verdicts(0.030, 0.002, 0.020), "fail");
  EXPECT_EQ(verdict_words({.value_mm = 0.030}), "");
}

TEST(AcceptanceReportTest, OfSeveralMeasurementsTheLargestErrorCounts) {
  const auto report = report_of({12.5, 12.515, 12.49}, {{"size", 0.025}, {"form", 0.04}});
  const auto worst = report.worst();
  ASSERT_EQ(worst.size(), 2U);
  EXPECT_EQ(worst[1].name, "size");
  EXPECT_NEAR(worst[1].value_mm, 0.030, 1e-4);
  EXPECT_FALSE(report.passes());
  EXPECT_TRUE(report_of({12.5, 12.51}, {{"size", 0.025}}).passes());
  EXPECT_TRUE(report_of({12.515}, {}).passes());
}

TEST(AcceptanceReportTest, ThePageIsWellFormedEscapesNamesAndNeedsNoOtherFile) {
  const auto report = report_of({12.5, 12.515}, {{"size", 0.025}});
  const std::string page = acceptance_html(report);
  EXPECT_EQ(unclosed(page), "");
  EXPECT_THAT(page, HasSubstr("&lt;scan 0&gt;"));
  EXPECT_THAT(page, HasSubstr("sphere of 25.000 mm, U = 0.0010 mm"));
  EXPECT_THAT(page, HasSubstr("grade refused"));
  for (const char* reference : {"http", "src=", "href", "url(", "@import", "<script", "<link", "nan", "inf<"}) {
    EXPECT_THAT(page, Not(HasSubstr(reference)));
  }
  EXPECT_EQ(page, acceptance_html(report_of({12.5, 12.515}, {{"size", 0.025}})));
  EXPECT_THAT(acceptance_html(report_of({12.5}, {})), Not(HasSubstr("class=\"grade")));
}

TEST(AcceptanceReportTest, TheJsonHasEveryResultWithItsLimitAndUncertainty) {
  const auto json = nlohmann::json::parse(acceptance_json(report_of({12.515}, {{"size", 0.025}})));
  EXPECT_EQ(json["format"], "scanrig-acceptance");
  EXPECT_FALSE(json["passes"]);
  EXPECT_EQ(json["artefact"]["diameter_mm"], 25.0);
  const auto& size = json["measurements"][0]["results"][1];
  EXPECT_EQ(size["name"], "size");
  EXPECT_NEAR(size["value_mm"], 0.030, 1e-4);
  EXPECT_NEAR(size["expanded_uncertainty_mm"], 0.001, 0.0005);
  EXPECT_EQ(size["verdict"], "fail");
  EXPECT_FALSE(json["measurements"][0]["results"][0].contains("limit_mm"));
  EXPECT_GT(json["measurements"][0]["features"][0]["seen_share"], 0.8);
  EXPECT_EQ(json["worst"], json["measurements"][0]["results"]);
}

TEST(AcceptanceReportTest, ImpossibleArtefactsAndLimitsAreRefused) {
  const auto message = [](const Artefact& artefact, const Limits& limits = {}) {
    const auto possible = check_artefact(artefact, limits);
    EXPECT_FALSE(possible);
    if (possible) return std::string();
    EXPECT_EQ(possible.error().code, ErrorCode::invalid_input);
    return possible.error().message;
  };
  EXPECT_THAT(message({.kind = Kind::sphere}), HasSubstr("diameter 0 mm"));
  EXPECT_THAT(message({.kind = Kind::ball_bar, .diameter_mm = 25.0, .length_mm = 20.0}), HasSubstr("length 20 mm"));
  EXPECT_THAT(message({.kind = Kind::step_gauge}), HasSubstr("heights: none"));
  EXPECT_THAT(message({.kind = Kind::step_gauge, .heights_mm = {5.0, 4.0}}), HasSubstr("heights 5, 4"));
  EXPECT_THAT(message({.kind = Kind::plane, .expanded_uncertainty_mm = -1.0}), HasSubstr("uncertainty -1 mm"));
  EXPECT_THAT(message(kCalibratedSphere, {{"flatness", 0.04}}),
              HasSubstr("limit flatness: a sphere has no such result"));
  EXPECT_THAT(message(kCalibratedSphere, {{"form", 0.0}}), HasSubstr("limit form=0"));
  EXPECT_TRUE(check_artefact(kCalibratedSphere, {{"form", 0.04}}));
}

}  // namespace
}  // namespace scanrig::acceptance
