#include <fmt/format.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "daemon/ctl/commands.h"
#include "pipeline/reconstruct/voxel_size.h"

namespace scanrig::ctl {
namespace {

/// Whether `scanrig reconstruct` accepts these words.
bool takes(const std::string& words) {
  CLI::App app;
  Chosen chosen;
  add_offline_commands(app, chosen);
  try {
    app.parse("reconstruct scan " + words);
    return true;
  } catch (const CLI::ParseError&) {
    return false;
  }
}

TEST(ReconstructOptions, VoxelsAreThoseTheDaemonMayAskItsChildFor) {
  for (const double voxel_mm : {kMinVoxelMm, 0.049, kMaxVoxelMm}) {
    EXPECT_TRUE(takes(fmt::format("--voxel-mm {}", voxel_mm))) << voxel_mm;
  }
  for (const double voxel_mm : {kMinVoxelMm - 0.001, kMaxVoxelMm + 0.001}) {
    EXPECT_FALSE(takes(fmt::format("--voxel-mm {}", voxel_mm))) << voxel_mm;
  }
}

TEST(ReconstructOptions, TheWatchIsOneOfThree) {
  for (const char* mode : {"refine", "report", "off"}) EXPECT_TRUE(takes(fmt::format("--watch {}", mode))) << mode;
  EXPECT_FALSE(takes("--watch sometimes"));
}

TEST(ReconstructOptions, AFixtureIsAFlag) {
  EXPECT_TRUE(takes("--fixture"));
  EXPECT_FALSE(takes("--fixture=putty"));
}

}  // namespace
}  // namespace scanrig::ctl
