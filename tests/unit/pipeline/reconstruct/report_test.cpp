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
  const auto report = Report({}, identity_of(manifest), std::nullopt).finished({});
  EXPECT_EQ(report["scan"], "20261121-093000-1");
  EXPECT_EQ(report["profile_sha256"], "p");
  EXPECT_EQ(report["config_sha256"], nlohmann::json::array({"a", "b"}));
}

}  // namespace
}  // namespace scanrig
