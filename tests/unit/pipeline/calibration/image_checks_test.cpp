#include "pipeline/calibration/corners/image_checks.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/calibration/board_renderer.h"

namespace scanrig::testing {
namespace {

struct Situation {
  TestCamera camera;
  BoardPlace place;
  Exposure exposure;
  cv::Rect glare;
  cv::Rect hand;

  [[nodiscard]] std::vector<ImageCheck> checks() const {
    cv::Mat image = render(make_print({}), camera, camera_from_board(place), exposure);
    if (!glare.empty()) image(glare) = 255;
    if (!hand.empty()) image(hand) = 60;
    const auto found = find_board(image, "BayerRG8", Board{});
    EXPECT_TRUE(found) << found.error().message;
    if (!found) return {};
    return check_board_image(*found, Board{}, image.size());
  }
};

/// The one problem of a situation.
void expect_only(const Situation& situation, ImageProblem problem, const std::string& words) {
  const auto checks = situation.checks();
  ASSERT_EQ(checks.size(), 1u) << (checks.empty() ? "" : checks[0].message + checks.back().message);
  EXPECT_EQ(checks[0].problem, problem);
  EXPECT_NE(checks[0].message.find(words), std::string::npos) << checks[0].message;
  EXPECT_LE(checks[0].message.size(), 120u);
  EXPECT_FALSE(checks[0].remark.empty());
  EXPECT_EQ(checks[0].remark.find(". "), std::string::npos) << "a remark has no instruction: " << checks[0].remark;
}

TEST(ImageChecks, AGoodImageHasNoProblem) { EXPECT_TRUE(Situation{}.checks().empty()); }

TEST(ImageChecks, NamesABlurredImage) {
  Situation situation;
  situation.exposure.lens_sigma_px = 2.0;
  expect_only(situation, ImageProblem::blurred, "Image blurred (2.0 px, at most 1.6)");
}

TEST(ImageChecks, NamesGlare) {
  Situation situation;
  situation.glare = {560, 400, 120, 80};
  expect_only(situation, ImageProblem::glare, "Glare on 2 % of the board");
}

TEST(ImageChecks, NamesABoardThatIsCutOff) {
  Situation situation;
  situation.place.centre = {75.0, 40.0, 0.0};
  expect_only(situation, ImageProblem::cut_off, "Board cut off at the right edge");
  EXPECT_TRUE(situation.checks()[0].is_minor) << "most of it is visible";
  situation.place.centre = {120.0, 40.0, 0.0};
  expect_only(situation, ImageProblem::cut_off, "corners visible. Move it into view.");
  EXPECT_FALSE(situation.checks()[0].is_minor);
  situation.place.centre = {-60.0, 100.0, 0.0};
  expect_only(situation, ImageProblem::cut_off, "Board cut off at the left and upper edge");
}

TEST(ImageChecks, NamesABoardThatIsTooSmall) {
  Situation situation;
  situation.place.tilt_deg = 5.0;
  situation.exposure.lens_sigma_px = 0.4;
  situation.camera.f = 2000.0;
  expect_only(situation, ImageProblem::too_small, "Board too small or too flat in the image");
}

TEST(ImageChecks, NamesABoardThatIsHidden) {
  Situation situation;
  situation.hand = {250, 150, 420, 640};
  expect_only(situation, ImageProblem::hidden, "corners visible");
}

}  // namespace
}  // namespace scanrig::testing
