#include "pipeline/calibration/board/print_board.h"

#include <gtest/gtest.h>

#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#include <regex>
#include <sstream>

#include "pipeline/calibration/corners/find_board.h"
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_board.hpp>
#include <opencv2/objdetect/aruco_dictionary.hpp>
#else
#include <opencv2/aruco/charuco.hpp>
#endif

namespace scanrig::testing {
namespace {

struct Page {
  double width_mm = 0.0;
  double height_mm = 0.0;
  cv::Mat1b image;
  std::string texts;
};

/// Paints the rectangles of a PDF with one page, `per_mm` pixels per millimetre; independent of the code that wrote it.
Page paint(const std::string& pdf, double per_mm) {
  Page page;
  std::smatch match;
  EXPECT_TRUE(std::regex_search(pdf, match, std::regex(R"(/MediaBox \[0 0 ([0-9.]+) ([0-9.]+)\])")));
  page.width_mm = std::stod(match[1]) * 25.4 / 72.0;
  page.height_mm = std::stod(match[2]) * 25.4 / 72.0;
  constexpr int kFine = 4;
  const double scale = per_mm * kFine;
  cv::Mat1b fine(static_cast<int>(std::lround(page.height_mm * scale)),
                 static_cast<int>(std::lround(page.width_mm * scale)), uchar{255});
  std::istringstream content(pdf.substr(pdf.find("stream\n") + 7, pdf.find("endstream") - pdf.find("stream\n") - 7));
  std::vector<double> numbers;
  std::vector<cv::Rect> pending;
  double unit_mm = 25.4 / 72.0;
  uchar grey = 0;
  std::string line;
  while (std::getline(content, line)) {
    if (line.starts_with("BT")) {
      page.texts += line + '\n';
      continue;
    }
    std::istringstream words(line);
    std::string word;
    while (words >> word) {
      if (word == "re") {
        const double x = numbers[0] * unit_mm * scale;
        const double top = (page.height_mm - (numbers[1] + numbers[3]) * unit_mm) * scale;
        const auto left = static_cast<int>(std::lround(x));
        const auto upper = static_cast<int>(std::lround(top));
        const auto right = static_cast<int>(std::lround(x + numbers[2] * unit_mm * scale));
        const auto lower = static_cast<int>(std::lround(top + numbers[3] * unit_mm * scale));
        pending.emplace_back(left, upper, right - left, lower - upper);
      } else if (word == "f") {
        for (const cv::Rect& rectangle : pending) fine(rectangle).setTo(grey);
        pending.clear();
      } else if (word == "g") {
        grey = numbers[0] > 0.5 ? 255 : 0;
      } else if (word == "cm") {
        EXPECT_EQ(numbers[0], numbers[3]);
        unit_mm *= numbers[0];
      } else {
        numbers.push_back(std::stod(word));
        continue;
      }
      numbers.clear();
    }
  }
  cv::resize(fine, page.image, {}, 1.0 / kFine, 1.0 / kFine, cv::INTER_AREA);
  return page;
}

/// OpenCV's own drawing of the board.
cv::Mat1b draw_by_opencv(const Board& board, int per_square) {
  cv::Mat image;
  const cv::Size squares(board.columns, board.rows);
  const cv::Size size(board.columns * per_square, board.rows * per_square);
  const auto square = static_cast<float>(board.square_mm);
  const auto marker = static_cast<float>(board.markers->size_mm);
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100);
  cv::aruco::CharucoBoard(squares, square, marker, dictionary).generateImage(size, image, 0, 1);
#else
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_100);
  cv::aruco::CharucoBoard::create(squares.width, squares.height, square, marker, dictionary)->draw(size, image, 0, 1);
#endif
  return image;
}

TEST(PrintBoard, IsTheBoardThatOpenCvDraws) {
  const Board board;
  const Page page = paint(print_board(board).value(), 10.0);
  EXPECT_NEAR(page.width_mm, 297.0, 0.01);
  EXPECT_NEAR(page.height_mm, 210.0, 0.01);
  const cv::Mat1b drawn = draw_by_opencv(board, 100);
  cv::Mat1f score;  // the board is somewhere on the page: the place of the least difference
  cv::Mat small_page, small_board;
  cv::resize(page.image, small_page, {}, 0.1, 0.1, cv::INTER_AREA);
  cv::resize(drawn, small_board, {}, 0.1, 0.1, cv::INTER_AREA);
  cv::matchTemplate(small_page, small_board, score, cv::TM_SQDIFF);
  cv::Point rough, place;
  cv::minMaxLoc(score, nullptr, nullptr, &rough, nullptr);
  const cv::Rect around(std::max(0, rough.x * 10 - 15), std::max(0, rough.y * 10 - 15), drawn.cols + 30,
                        drawn.rows + 30);
  cv::matchTemplate(page.image(around), drawn, score, cv::TM_SQDIFF);
  cv::minMaxLoc(score, nullptr, nullptr, &place, nullptr);
  const cv::Mat difference = cv::abs(page.image(around)(cv::Rect(place, drawn.size())) - drawn) > 128;
  EXPECT_LT(cv::countNonZero(difference), 0.002 * static_cast<double>(drawn.total()));
}

TEST(PrintBoard, IsFoundToScaleOnItsOwnPage) {
  const Board board;
  constexpr double kPerMm = 5.0;
  const Page page = paint(print_board(board).value(), kPerMm);
  cv::Mat blurred;
  cv::GaussianBlur(page.image, blurred, {}, 0.8);
  const auto found = find_board(blurred, "Mono8", board);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->corners.size(), 88u);
  const Eigen::Vector2d origin = found->corners[0].pixel;
  for (const CornerObservation& corner : found->corners) {
    const Eigen::Vector2d expected = kPerMm * (board.corner(corner.id) - board.corner(0)).head<2>();
    EXPECT_LT((corner.pixel - origin - expected).norm(), 0.03) << corner.id;
  }
}

TEST(PrintBoard, ShowsItsLengthsAndWhatItIs) {
  const Page page = paint(print_board(Board{}).value(), 10.0);
  EXPECT_NE(page.texts.find("120 mm between the marks"), std::string::npos);
  EXPECT_NE(page.texts.find("90 mm between the marks"), std::string::npos);
  EXPECT_NE(page.texts.find("12 x 9, squares 10 mm, markers 6 mm, 4x4_100. Print at 100 %."), std::string::npos);
  // Below the board, only two thin lines, 120 mm from centre to centre.
  for (int y = page.image.rows - 1; y > 0; --y) {
    std::vector<int> dark;
    for (int x = 0; x < page.image.cols; ++x) {
      if (page.image(y, x) < 220) dark.push_back(x);
    }
    if (dark.empty()) continue;
    ASSERT_GE(dark.size(), 2u);
    EXPECT_LE(dark.size(), 4u);
    EXPECT_NEAR(dark.back() - dark.front(), 1200, 1);
    break;
  }
}

TEST(PrintBoard, IsAFileWithATableOfItsObjects) {
  const std::string pdf = print_board(Board{}).value();
  EXPECT_EQ(pdf, print_board(Board{}).value());
  EXPECT_TRUE(pdf.starts_with("%PDF-1."));
  EXPECT_TRUE(pdf.ends_with("%%EOF\n"));
  const std::size_t table = std::stoul(pdf.substr(pdf.find("startxref\n") + 10));
  ASSERT_EQ(pdf.substr(table, 5), "xref\n");
  std::istringstream lines(pdf.substr(table));
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(lines, line);  // xref, its range, the free entry
  for (int object = 1; object <= 5; ++object) {
    std::getline(lines, line);
    EXPECT_EQ(line.size(), 19u);
    EXPECT_TRUE(pdf.substr(std::stoul(line), 10).starts_with(std::to_string(object) + " 0 obj"));
  }
  const std::size_t start = pdf.find("stream\n") + 7;
  EXPECT_EQ(std::stoul(pdf.substr(pdf.find("/Length ") + 8)), pdf.find("endstream") - start);
}

TEST(PrintBoard, TakesAnyPageThatIsLargeEnough) {
  EXPECT_TRUE(print_board(Board{}, {.width_mm = 210.0, .height_mm = 297.0}));
  Board large;
  large.square_mm = 25.0;
  const auto refused = print_board(large);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
  EXPECT_NE(refused.error().message.find("use a larger page"), std::string::npos);
  EXPECT_TRUE(print_board(large, {.width_mm = 420.0, .height_mm = 420.0}));
  large.markers.reset();
  const auto plain = print_board(large, {.width_mm = 420.0, .height_mm = 420.0});
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->find("markers"), std::string::npos);
}

TEST(Board, RefusesWhatCannotBe) {
  Board board;
  board.columns = 2;
  EXPECT_EQ(check_board(board).error().code, ErrorCode::invalid_input);
  board = {};
  board.markers->size_mm = 10.0;
  EXPECT_EQ(check_board(board).error().code, ErrorCode::invalid_input);
  board = {};
  board.columns = 30;
  EXPECT_NE(check_board(board).error().message.find("has 100"), std::string::npos);
  board.markers->dictionary = "4x4_250";
  EXPECT_TRUE(check_board(board));
}

TEST(Board, HasItsFrameInTheMiddleOfTheCorners) {
  const Board board;
  EXPECT_EQ(board.corner(0), Eigen::Vector3d(-50.0, -35.0, 0.0));
  EXPECT_EQ(board.corner(10), Eigen::Vector3d(50.0, -35.0, 0.0));
  EXPECT_EQ(board.corner(87), Eigen::Vector3d(50.0, 35.0, 0.0));
  EXPECT_EQ(marker_cells(board).size(), 54u);
}

}  // namespace
}  // namespace scanrig::testing
