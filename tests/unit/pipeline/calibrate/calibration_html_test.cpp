#include "pipeline/calibrate/report/calibration_html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "pipeline/calibrate/report/drawing.h"
#include "pipeline/calibrate/report/html.h"
#include "tests/unit/pipeline/calibrate/well_formed.h"
#include "tests/unit/pipeline/calibration/synthetic_board_rig.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::Not;

FolderCalibration solved_of(const CalibrationInput& input) {
  FolderCalibration outcome;
  outcome.input = input;
  auto judged = judge_calibration(input);
  EXPECT_TRUE(judged) << judged.error().message;
  if (judged) outcome.judged = std::move(*judged);
  return outcome;
}

/// A rig with lens residual, warp and rim dots; solved once for all tests.
const FolderCalibration& outcome_with_all() {
  static const FolderCalibration outcome = [] {
    RigFaults faults;
    faults.lens_px = 0.05;
    faults.warp_mm = 0.1;
    faults.print_mm = 0.008;
    faults.gear_deg = 0.01;
    faults.has_dots = true;
    SyntheticBoardRig rig(faults, 301);
    return solved_of(rig.observe(3));
  }();
  return outcome;
}

const CalibrationOrigin kOrigin{.date = "2026-11-25T09:00:00Z"};

std::size_t count_of(const std::string& text, const std::string& piece) {
  std::size_t count = 0;
  for (auto at = text.find(piece); at != std::string::npos; at = text.find(piece, at + piece.size())) ++count;
  return count;
}

TEST(CalibrationHtml, IsOneWellFormedPageWithAllSections) {
  const std::string page = calibration_html(outcome_with_all(), kOrigin);
  EXPECT_EQ(unclosed(page), "");
  for (const char* title : {"What was left out", "Residuals", "Coverage", "Sigma at the object", "A against B",
                            "Lenses", "Board", "Turntable", "Rim dots"}) {
    EXPECT_THAT(page, HasSubstr(fmt::format(">{}</h", title)));
  }
  EXPECT_THAT(page, HasSubstr("2026-11-25T09:00:00Z"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_THAT(page, Not(HasSubstr("inf")));
}

TEST(CalibrationHtml, NeedsNoOtherFileAndNoScript) {
  const std::string page = calibration_html(outcome_with_all(), kOrigin);
  for (const char* reference : {"http", "src=", "href", "url(", "@import", "<script", "<link", "<iframe"}) {
    EXPECT_THAT(page, Not(HasSubstr(reference)));
  }
}

TEST(CalibrationHtml, HasTheSameBytesForTheSameInput) {
  const auto again = FolderCalibration(outcome_with_all());
  EXPECT_EQ(calibration_html(outcome_with_all(), kOrigin), calibration_html(again, kOrigin));
}

TEST(CalibrationHtml, DrawsOneTilePerImageWithAnArrowForEachResidual) {
  const FolderCalibration& outcome = outcome_with_all();
  const std::string page = calibration_html(outcome, kOrigin);
  EXPECT_EQ(count_of(page, "<figure class=\"tile\">"), outcome.judged.solved.images.size());
  std::smatch said;
  const std::regex sentence("measured pixel minus model, drawn ([0-9.e+]+) times too long");
  ASSERT_TRUE(std::regex_search(page, said, sentence));
  const double exaggeration = std::stod(said[1]);

  // Tiles are in the order of the placements, the left images of a placement first.
  const ImageFit& first = outcome.judged.solved.images[0];
  const std::string tile = page.substr(page.find("<figure class=\"tile\">"));
  const auto begin = tile.find("<path class=\"arrows ");
  const std::string path = tile.substr(begin, tile.find("/>", begin) - begin);
  EXPECT_EQ(count_of(path, "M"), first.residuals.size());
  const std::regex arrow("M([-0-9.]+) ([-0-9.]+)l([-0-9.]+) ([-0-9.]+)");
  const double scale = 150.0 / outcome.input.width;  // a tile's width
  std::size_t i = 0;
  for (std::sregex_iterator at(path.begin(), path.end(), arrow), end; at != end; ++at, ++i) {
    const CornerResidual& r = first.residuals[i];
    EXPECT_NEAR(std::stod((*at)[1]), scale * (r.pixel.x() + 0.5), 0.06);
    EXPECT_NEAR(std::stod((*at)[2]), scale * (r.pixel.y() + 0.5), 0.06);
    EXPECT_NEAR(std::stod((*at)[3]), scale * exaggeration * r.miss.x(), 0.06);
    EXPECT_NEAR(std::stod((*at)[4]), scale * exaggeration * r.miss.y(), 0.06);
  }
  EXPECT_EQ(i, first.residuals.size());
}

TEST(CalibrationHtml, OfARefusedOneSaysWhy) {
  FolderCalibration outcome = outcome_with_all();
  outcome.judged.judgement.grade = CalibrationGrade::refused;
  outcome.judged.judgement.sentences = {"Left and right cameras swapped: exchange the serials."};
  ASSERT_FALSE(calibration_json(outcome, kOrigin));
  const std::string page = calibration_html(outcome, kOrigin);
  EXPECT_EQ(unclosed(page), "");
  EXPECT_THAT(page, HasSubstr("refused"));
  EXPECT_THAT(page, HasSubstr("<li>Left and right cameras swapped: exchange the serials.</li>"));
}

TEST(CalibrationHtml, EscapesNamesAndNamesWhatWasLeftOut) {
  FolderCalibration outcome = outcome_with_all();
  ImageFit& image = outcome.judged.solved.images[3];
  image.name = "<script>x&y\"</script>";
  image.is_used = false;
  image.left_out_because = "too few corners";
  outcome.boards.remarks = {{image.name, 1, "Image blurred <3.", true}, {"pair <2>", 0, "a remark", false}};
  const std::string page = calibration_html(outcome, kOrigin);
  EXPECT_EQ(unclosed(page), "");
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("<td>&lt;script&gt;x&amp;y&quot;&lt;/script&gt;</td><td>right</td>"));
  EXPECT_THAT(page, HasSubstr("Image blurred &lt;3."));
  EXPECT_THAT(page, HasSubstr("<td>a remark</td><td>1</td><td>pair &lt;2&gt;, left</td>"));
}

TEST(CalibrationHtml, OfBoardsHeldByHandAndOfOneCameraHasNoVolume) {
  SyntheticBoardRig rig({}, 302);
  const std::string by_hand = calibration_html(solved_of(rig.observe_hand_held(12)), {});
  EXPECT_EQ(unclosed(by_hand), "");
  EXPECT_THAT(by_hand, HasSubstr("No volume to grade"));
  CalibrationInput one = rig.observe(3);
  one.cameras = 1;
  const FolderCalibration outcome = solved_of(one);
  const std::string alone = calibration_html(outcome, {});
  EXPECT_EQ(unclosed(alone), "");
  EXPECT_EQ(count_of(alone, "<figure class=\"tile\">"), one.pairs.size());
}

TEST(ReportNumbers, AreRoundAndNeverMinusZero) {
  EXPECT_EQ(report::number(-0.0004, 2), "0.00");
  EXPECT_EQ(report::number(-1.25, 1), "-1.2");
  EXPECT_EQ(report::number(std::nan(""), 1), "–");
  EXPECT_EQ(report::round_down(0.0199), 0.01);
  EXPECT_DOUBLE_EQ(report::round_down(730.0), 500.0);
  EXPECT_DOUBLE_EQ(report::round_down(0.5), 0.5);
}

}  // namespace
}  // namespace scanrig
