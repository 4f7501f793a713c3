#include "pipeline/calibration/board/print_board.h"

#include <fmt/format.h>

#include <iterator>
#include <vector>

#include "pipeline/calibration/board/markers.h"

namespace scanrig {
namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
constexpr double kMarkStrip = 9.0;      // mm beside and below the white border, for a length mark
constexpr double kTextHeight = 3.0;     // mm
constexpr double kTextStrip = 6.0;      // mm below the marks
constexpr double kMarkLength = 4.0;     // mm, length of one thin line
constexpr double kMarkThickness = 0.1;  // mm

/// Operators of a PDF content stream; millimetres from the lower left corner of the page, y up.
class Drawing {
 public:
  Drawing() { add("{:.9f} 0 0 {:.9f} 0 0 cm\n", kPointsPerMm, kPointsPerMm); }

  void set_grey(int grey) { add("{} g\n", grey); }
  void rectangle(double x, double y, double width, double height) {
    add("{:.5f} {:.5f} {:.5f} {:.5f} re\n", x, y, width, height);
  }
  /// Fills all rectangles since the last call at once, so that no seam shows between neighbours.
  void fill() { add("f\n"); }
  void text(double x, double y, double height, const std::string& words) {
    add("BT /F1 {:.3f} Tf {:.5f} {:.5f} Td ({}) Tj ET\n", height, x, y, escaped(words));
  }
  void text_upwards(double x, double y, double height, const std::string& words) {
    add("BT /F1 {:.3f} Tf 0 1 -1 0 {:.5f} {:.5f} Tm ({}) Tj ET\n", height, x, y, escaped(words));
  }
  [[nodiscard]] const std::string& operators() const { return operators_; }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(operators_), format, std::forward<Args>(args)...);
  }
  static std::string escaped(const std::string& words) {
    std::string safe;
    for (const char c : words) {
      if (c == '(' || c == ')' || c == '\\') safe += '\\';
      safe += c >= ' ' && c <= '~' ? c : '?';
    }
    return safe;
  }

  std::string operators_;
};

/// Places on the page, millimetres, y up.
struct Layout {
  double width = 0.0;   // of the board
  double height = 0.0;  // of the board
  double border = 0.0;  // white, around the board
  double left = 0.0;    // edges of the board
  double bottom = 0.0;
};

Result<Layout> lay_out_page(const Board& board, const PageOptions& page) {
  Layout layout;
  layout.width = board.columns * board.square_mm;
  layout.height = board.rows * board.square_mm;
  layout.border = board.square_mm;
  const double full_width = layout.width + 2.0 * layout.border + kMarkStrip;
  const double full_height = layout.height + 2.0 * layout.border + kMarkStrip + kTextStrip;
  const double free_width = page.width_mm - 2.0 * page.margin_mm - full_width;
  const double free_height = page.height_mm - 2.0 * page.margin_mm - full_height;
  if (!(free_width >= 0.0) || !(free_height >= 0.0)) {
    return fail(
        ErrorCode::invalid_input,
        "board: {:g} x {:g} mm needs a page of {:g} x {:g} mm, this one is {:g} x {:g} mm; use a larger page or "
        "smaller squares",
        layout.width, layout.height, full_width + 2.0 * page.margin_mm, full_height + 2.0 * page.margin_mm,
        page.width_mm, page.height_mm);
  }
  layout.left = page.margin_mm + 0.5 * free_width + kMarkStrip + layout.border;
  layout.bottom = page.margin_mm + 0.5 * free_height + kTextStrip + kMarkStrip + layout.border;
  return layout;
}

Result<void> draw_markers(const Board& board, const Layout& layout, Drawing& drawing) {
  std::vector<std::pair<Eigen::Vector2d, cv::Mat1b>> markers;
  for (const MarkerCell& cell : marker_cells(board)) {
    const double x = layout.left + (cell.column + 0.5) * board.square_mm - 0.5 * board.markers->size_mm;
    const double y = layout.bottom + (board.rows - cell.row - 0.5) * board.square_mm + 0.5 * board.markers->size_mm;
    auto bits = marker_bits(board.markers->dictionary, cell.id);
    if (!bits) return pass_on(bits);
    markers.emplace_back(Eigen::Vector2d(x, y), std::move(*bits));
    drawing.rectangle(x, y - board.markers->size_mm, board.markers->size_mm, board.markers->size_mm);
  }
  drawing.fill();
  drawing.set_grey(1);
  for (const auto& [upper_left, bits] : markers) {
    const double size = board.markers->size_mm / bits.cols;
    for (int row = 0; row < bits.rows; ++row) {
      for (int column = 0; column < bits.cols; ++column) {
        if (bits(row, column) == 0) continue;
        drawing.rectangle(upper_left.x() + column * size, upper_left.y() - (row + 1) * size, size, size);
      }
    }
  }
  drawing.fill();
  drawing.set_grey(0);
  return {};
}

void draw_squares(const Board& board, const Layout& layout, Drawing& drawing) {
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      if (is_white_square(column, row, BoardParity::upper_left_black)) continue;
      drawing.rectangle(layout.left + column * board.square_mm,
                        layout.bottom + (board.rows - row - 1) * board.square_mm, board.square_mm, board.square_mm);
    }
  }
  drawing.fill();
}

void draw_length_marks(const Layout& layout, Drawing& drawing) {
  const double half = 0.5 * kMarkThickness;
  const double below = layout.bottom - layout.border - kMarkLength;
  const double beside = layout.left - layout.border - kMarkLength;
  for (const double end : {0.0, layout.width}) {
    drawing.rectangle(layout.left + end - half, below, kMarkThickness, kMarkLength);
  }
  for (const double end : {0.0, layout.height}) {
    drawing.rectangle(beside, layout.bottom + end - half, kMarkLength, kMarkThickness);
  }
  drawing.fill();
  drawing.text(layout.left + 2.0, below + 0.5, kTextHeight, fmt::format("{:g} mm between the marks", layout.width));
  drawing.text_upwards(beside + kMarkLength - 0.5, layout.bottom + 2.0, kTextHeight,
                       fmt::format("{:g} mm between the marks", layout.height));
}

/// Objects of a PDF file, one after the other, with the table of their places [ISO 32000-1, 7.5].
std::string as_pdf(const PageOptions& page, const std::string& content) {
  const std::string objects[] = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format(
          "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 4 0 R /Resources << /Font << /F1 "
          "5 0 R >> >> >>",
          page.width_mm * kPointsPerMm, page.height_mm * kPointsPerMm),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", content.size(), content),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
  };
  std::string file = "%PDF-1.6\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", std::size(objects) + 1);
  int number = 0;
  for (const std::string& object : objects) {
    table += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", ++number, object);
  }
  const std::size_t table_start = file.size();
  return file + table +
         fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", std::size(objects) + 1,
                     table_start);
}

}  // namespace

std::string board_check_line(const Board& board) {
  std::string line = fmt::format("scanrig board {} x {}, squares {:g} mm", board.columns, board.rows, board.square_mm);
  if (board.markers) line += fmt::format(", markers {:g} mm, {}", board.markers->size_mm, board.markers->dictionary);
  return line + fmt::format(". Print at 100 %. Distance between marks: {:g} mm and {:g} mm.",
                            board.columns * board.square_mm, board.rows * board.square_mm);
}

Result<std::string> print_board(const Board& board, const PageOptions& page) {
  if (auto good = check_board(board); !good) return pass_on(good);
  const auto layout = lay_out_page(board, page);
  if (!layout) return pass_on(layout);
  Drawing drawing;
  drawing.set_grey(0);
  draw_squares(board, *layout, drawing);
  if (board.markers) {
    if (auto drawn = draw_markers(board, *layout, drawing); !drawn) return pass_on(drawn);
  }
  draw_length_marks(*layout, drawing);
  const std::string line = board_check_line(board);
  const double room = page.width_mm - page.margin_mm - layout->left;
  const double size =
      std::min(kTextHeight, room / (0.56 * static_cast<double>(line.size())));  // Helvetica's mean width
  drawing.text(layout->left, layout->bottom - layout->border - kMarkStrip - kTextStrip + 1.5, size, line);
  return as_pdf(page, drawing.operators());
}

}  // namespace scanrig
