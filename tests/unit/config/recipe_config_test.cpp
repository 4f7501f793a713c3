#include <gmock/gmock.h>

#include "config/rig_config.h"
#include "tests/unit/config/file_under_test.h"

namespace scanrig::config {
namespace {

using testing::HasSubstr;

/// Job settings in rig.toml: recipes, storage, quiet hours, receivers of failure reports.
class RecipeConfigTest : public FileUnderTest {
 protected:
  Result<RigConfig> read(const std::string& text) {
    write(text);
    return read_rig_config(file_, std::filesystem::path(SCANRIG_SOURCE_DIR) / "config/drives");
  }
  void expect_problem(const std::string& text, const std::string& problem) {
    const auto rig = read(text);
    ASSERT_FALSE(rig) << problem;
    EXPECT_EQ(rig.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(rig.error().message, HasSubstr(problem));
  }
  std::string with_inputs() const {
    return replaced(
        example_, "start = { line = \"START\", active = \"low\" }",
        "start = { line = \"START\" }\npart_present = { line = \"PART\" }\nflipped = { line = \"FLIPPED\" }");
  }
  const std::string example_ = shipped("rigs/example.toml");
  const std::string line_ = R"(
[recipe.line]
views = 6
poses = 2
flip_timeout_min = 2
flip = "signal"
start = "part_present"
fixture = true
limits = { min_measured_share = 0.9, max_residual_mm = 0.05 }
)";
};

TEST_F(RecipeConfigTest, ARecipeMayLeaveEverythingButTheScanToTheButton) {
  const auto rig = read(example_);
  ASSERT_TRUE(rig) << rig.error().message;
  const auto& recipe = rig->recipes.at("default");
  EXPECT_EQ(recipe.flip, RecipeConfig::Flip::button);
  EXPECT_EQ(recipe.start, RecipeConfig::Start::button);
  EXPECT_FALSE(recipe.fixture);
  EXPECT_FALSE(recipe.min_measured_share);
  EXPECT_FALSE(rig->quiet_hours);
  EXPECT_FALSE(rig->webhook);
  EXPECT_FALSE(rig->storage.keep_days);
}

TEST_F(RecipeConfigTest, AScanHasUpToEightPoses) {
  const auto rig =
      read(example_ + replaced(line_, "poses = 2\nflip_timeout_min = 2\nflip = \"signal\"\nstart = \"part_present\"",
                               "poses = 8\nflip_timeout_min = 2"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->recipes.at("line").poses, 8);
  expect_problem(with_inputs() + replaced(line_, "poses = 2", "poses = 9"), "poses");
}

TEST_F(RecipeConfigTest, ACalibrationHasTheStandardBoardUnlessAnotherIsNamed) {
  const auto standard = read(example_);
  ASSERT_TRUE(standard) << standard.error().message;
  EXPECT_EQ(standard->calibration.board.columns, 12);
  EXPECT_FALSE(standard->calibration.rim_dots);
  EXPECT_FALSE(standard->calibration.length_mm);
  EXPECT_FALSE(standard->calibration.accepts_by_itself);
  const std::string board = R"([calibration]
board = { columns = 9, rows = 7, square_mm = 8.0, marker_mm = 5.0, dictionary = "4x4_50", thickness_mm = 4.0, material = "paper" }
table_radius_mm = 110
rim_dots = { count = 36, radius_mm = 104.5, diameter_mm = 2.4 }
length_mm = 56.01
length_sigma_mm = 0.004
check_every_h = 168
accept = "automatic"
)";
  const auto rig = read(replaced(example_, "[calibration]\n", board));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->calibration.board.rows, 7);
  EXPECT_EQ(rig->calibration.board.markers->size_mm, 5.0);
  EXPECT_EQ(rig->calibration.board_kind, BoardKind::paper);
  EXPECT_EQ(rig->calibration.table_radius_mm, 110.0);
  EXPECT_EQ(rig->calibration.rim_dots->count, 36);
  EXPECT_EQ(rig->calibration.length_mm, 56.01);
  EXPECT_EQ(rig->calibration.check_every, std::chrono::hours(168));
  EXPECT_TRUE(rig->calibration.accepts_by_itself);
  expect_problem(replaced(example_, "[calibration]\n", replaced(board, "56.01", "64.0")), "length_mm");
  expect_problem(replaced(example_, "[calibration]\n", replaced(board, "marker_mm = 5.0", "marker_mm = 9.0")), "board");
  expect_problem(replaced(example_, "[calibration]\n", "[calibration]\nlength_sigma_mm = 0.1\n"), "needs length_mm");
}

TEST_F(RecipeConfigTest, ALineHasSignalsAndLimits) {
  const auto rig = read(with_inputs() + line_);
  ASSERT_TRUE(rig) << rig.error().message;
  const auto& recipe = rig->recipes.at("line");
  EXPECT_EQ(recipe.views, 6);
  EXPECT_EQ(recipe.flip, RecipeConfig::Flip::signal);
  EXPECT_EQ(recipe.start, RecipeConfig::Start::part_present);
  EXPECT_TRUE(recipe.fixture);
  EXPECT_EQ(recipe.min_measured_share, 0.9);
  EXPECT_EQ(recipe.max_residual_mm, 0.05);
}

TEST_F(RecipeConfigTest, AClusterHasKeysOfItsOwn) {
  const std::string keys = R"(voxel_mm = 0.25
slurm_partition = "scans"
slurm_options = ["--qos=low", "--account=rig"]
slurm_program = "/opt/scanrig"
slurm_stage = "/srv/scans"
slurm_cores = 4
slurm_resubmits = 1
slurm_fallback = "local"
slurm_wait_min = 5
)";
  const auto in_process = replaced(example_, "voxel_mm = 0.25\n", keys);
  const auto text = replaced(in_process, "executor = \"in_process\"", "executor = \"slurm\"");
  const auto rig = read(text);
  ASSERT_TRUE(rig) << rig.error().message;
  const auto& reconstruction = rig->reconstruction;
  EXPECT_EQ(reconstruction.executor, ReconstructionConfig::Executor::slurm);
  EXPECT_THAT(reconstruction.slurm.options, testing::ElementsAre("--qos=low", "--account=rig"));
  EXPECT_EQ(reconstruction.slurm.stage, "/srv/scans");
  EXPECT_EQ(reconstruction.slurm.fallback, SlurmConfig::Fallback::local);
  EXPECT_EQ(reconstruction.slurm.wait, std::chrono::minutes(5));
  expect_problem(in_process, "slurm_stage: needs executor = \"slurm\"");
  expect_problem(replaced(text, "\"--qos=low\"", "\"low\""), "holds options of sbatch");
  expect_problem(replaced(text, "slurm_cores = 4", "slurm_cores = 0"), "slurm_cores");
}

TEST_F(RecipeConfigTest, OldNamesAreReadWithAWarning) {
  auto old_names = std::string(line_);
  for (const auto& [now, before] : {std::pair("flip = \"signal\"", "flip = \"line\""),        // old name
                                    std::pair("min_measured_share", "least_measured_share"),  // old name
                                    std::pair("max_residual_mm", "most_residual_mm")}) {      // old name
    old_names = replaced(old_names, now, before);
  }
  old_names = replaced(with_inputs(), "voxel_mm = 0.25", "voxel_mm = 0.25\nlimit_min = 7") + old_names;
  const auto rig = read(old_names);
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->recipes.at("line").flip, RecipeConfig::Flip::signal);
  EXPECT_EQ(rig->recipes.at("line").min_measured_share, 0.9);
  EXPECT_EQ(rig->reconstruction.timeout, std::chrono::minutes(7));
  ASSERT_EQ(rig->warnings.size(), 4u);
  EXPECT_THAT(rig->warnings, testing::Contains(testing::HasSubstr(
                                 "[recipe.line] limits.most_residual_mm: this key is called max_residual_mm now")));
  const auto both = read(replaced(old_names, "limit_min = 7", "limit_min = 7\ntimeout_min = 8"));
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, testing::HasSubstr("limit_min: unknown key"));
}

TEST_F(RecipeConfigTest, SignalsNeedTheirInputs) {
  expect_problem(example_ + line_, "[recipe.line] flip: \"signal\" needs the input flipped in [panel]");
  expect_problem(example_ + line_, "[recipe.line] start: \"part_present\" needs the input part_present in [panel]");
}

TEST_F(RecipeConfigTest, WhatBeginsByASignalNeedsAGuard) {
  const auto open = replaced(with_inputs() + line_, "guard = { line = \"GUARD_OK\", active = \"low\" }", "#");
  expect_problem(open, "[recipe.line] flip: \"signal\" needs a guard in [safety]");
  expect_problem(open, "[recipe.line] start: \"part_present\" needs a guard in [safety]");
}

TEST_F(RecipeConfigTest, LimitsAreChecked) {
  const auto text = replaced(with_inputs() + line_, "min_measured_share = 0.9", "min_measured_share = 90");
  expect_problem(text, "limits.min_measured_share: 90 is not between 0 and 1");
}

TEST_F(RecipeConfigTest, QuietHoursAreTimesOfTheDay) {
  const auto rig = read(example_ + "\n[quiet_hours]\nfrom = \"22:30\"\nto = \"06:00\"\n");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->quiet_hours->from, std::chrono::minutes(22 * 60 + 30));
  EXPECT_EQ(rig->quiet_hours->to, std::chrono::hours(6));
  for (const char* wrong : {"24:00", "12:60", "noon", "1:2:3", "-1:00", "7"}) {
    expect_problem(example_ + fmt::format("\n[quiet_hours]\nfrom = \"{}\"\nto = \"06:00\"\n", wrong),
                   fmt::format("[quiet_hours] from: \"{}\" is no time of day", wrong));
  }
}

TEST_F(RecipeConfigTest, StorageMayBeLimitedAndFailuresTold) {
  const auto text = replaced(example_, "reserve_gib = 20", "reserve_gib = 20\nkeep_days = 90\nkeep_gib = 400");
  const auto rig = read(text + "\n[webhook]\nurl = \"http://line:8080/failed\"\n");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->storage.keep_days, std::chrono::days(90));
  EXPECT_EQ(rig->storage.keep_gib, 400.0);
  EXPECT_EQ(rig->webhook->host, "line");
  EXPECT_EQ(rig->webhook->port, "8080");
  EXPECT_EQ(rig->webhook->path, "/failed");
  EXPECT_EQ(read(text + "\n[webhook]\nurl = \"http://line\"\n")->webhook->port, "80");
  for (const char* wrong : {"line:8080", "https://line/", "http://", "http://line:", "http://line:x/"}) {
    expect_problem(text + fmt::format("\n[webhook]\nurl = \"{}\"\n", wrong),
                   fmt::format("[webhook] url: \"{}\" is no http://HOST:PORT/PATH", wrong));
  }
}

}  // namespace
}  // namespace scanrig::config
