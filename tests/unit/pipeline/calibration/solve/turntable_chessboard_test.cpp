#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "pipeline/calibration/solve/solve_calibration.h"
#include "tests/shared_data.h"

namespace scanrig {
namespace {

/// Corner lists of a real chessboard on a real turntable, two placements, one camera.
std::filesystem::path folder() { return shared_data() / "turntable_chessboard"; }

/// The corner lists by table angle, whichever of the placement's two files holds them.
nlohmann::json corner_lists(int placement) {
  for (const char* name : {"image_points_target_", "chessboard_"}) {
    std::ifstream file(folder() / (name + std::to_string(placement) + ".json"));
    const nlohmann::json json = nlohmann::json::parse(file);
    if (json.contains("image_points")) return json["image_points"]["side"];
    if (json.contains("side")) return json["side"];
  }
  return {};
}

CalibrationInput chessboard(const std::vector<int>& placements) {
  CalibrationInput input;
  input.cameras = 1;
  input.board.columns = 9;
  input.board.rows = 7;
  input.board.square_mm = 47.0;
  input.board.markers.reset();
  input.board_kind = BoardKind::paper;
  input.width = 2056;
  input.height = 2454;
  input.nominal_focal_px = 4800.0;
  input.serials = {"side", ""};
  for (const int placement : placements) {
    std::map<double, nlohmann::json> by_angle;
    const nlohmann::json lists = corner_lists(placement);
    for (const auto& [angle, corners] : lists.items()) by_angle[std::stod(angle)] = corners;
    for (const auto& [angle, corners] : by_angle) {
      BoardPair pair;
      pair.name = "placement " + std::to_string(placement) + " angle " + std::to_string(std::lround(angle));
      pair.placement = placement;
      pair.angle_rad = angle * std::numbers::pi / 180.0;
      for (std::size_t id = 0; id < corners.size(); ++id) {
        const nlohmann::json& place = corners[id][0].is_array() ? corners[id][0] : corners[id];
        pair.left.corners.push_back({static_cast<int>(id), {place[0].get<double>(), place[1].get<double>()}, 1.0});
      }
      input.pairs.push_back(pair);
    }
  }
  return input;
}

TEST(TurntableChessboard, OneAxisFitsBothPlacements) {
  if (!std::filesystem::exists(folder())) GTEST_SKIP() << "no shared data: " << folder();
  const CalibrationInput input = chessboard({1, 2});
  ASSERT_EQ(input.pairs.size(), 90U);
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_LT(solved->median_px, 0.12);
  // This table errs by 0.023 deg rms, so that a line through its angles is known to about 6e-5.
  EXPECT_NEAR(std::abs(solved->table.gear), 1.00024, 2e-4);
  int left_out = 0;
  for (const ImageFit& image : solved->images) {
    if (image.is_used) continue;
    ++left_out;
    EXPECT_GT(image.rms_px, 2.0 * solved->median_px) << image.name << " " << image.left_out_because;
  }
  EXPECT_GT(left_out, 0);
  EXPECT_LT(left_out, 15);
}

TEST(TurntableChessboard, WithAStiffTableItsGearIsThatOfAnIndependentFit) {
  if (!std::filesystem::exists(folder())) GTEST_SKIP() << "no shared data: " << folder();
  // The independent fit (README of the data) has one axis, one gear and no error of single angles.
  CalibrationInput input = chessboard({1, 2});
  input.priors.angle_deg = input.priors.table_tilt_deg = input.priors.table_shift_mm = 1e-6;
  const auto solved = solve_calibration(input);
  ASSERT_TRUE(solved) << solved.error().message;
  EXPECT_NEAR(std::abs(solved->table.gear), 1.00024, 1e-4);
  EXPECT_LT(solved->median_px, 0.12);
}

}  // namespace
}  // namespace scanrig
