#include "pipeline/importers/stanford_files.h"

#include <charconv>
#include <cmath>
#include <string_view>

#include "core/files.h"

namespace scanrig {
namespace {

constexpr double kMmPerMetre = 1000.0;

/// Words and lines of a text, one after another.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}

  /// The next word; empty at the end.
  std::string_view next() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    return word;
  }
  std::string_view next_line() {
    const std::string_view line = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(line.size() + 1, rest_.size()));
    return line;
  }
  /// The next word as a finite number; NaN for other words.
  double number() {
    const std::string_view word = next();
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() ? value : std::nan("");
  }
  [[nodiscard]] bool at_end() const { return rest_.find_first_not_of(" \t\r\n") == std::string_view::npos; }

 private:
  std::string_view rest_;
};

struct GridHeader {
  bool ascii = false;
  int cols = 0;
  int rows = 0;
  int vertices = 0;
  int properties = 0;  ///< numbers per vertex
  int cells = 0;
};

GridHeader read_header(Words& text) {
  GridHeader header;
  std::string_view element;
  while (!text.at_end()) {
    Words line(text.next_line());
    const std::string_view keyword = line.next();
    if (keyword == "end_header") break;
    const std::string_view name = line.next();
    const auto count = [&line] {
      const double value = line.number();
      return value >= 0.0 && value <= 1e8 ? static_cast<int>(value) : 0;
    };
    if (keyword == "format") header.ascii = name == "ascii";
    if (keyword == "obj_info" && name == "num_cols") header.cols = count();
    if (keyword == "obj_info" && name == "num_rows") header.rows = count();
    if (keyword == "element") element = name;
    if (keyword == "element" && name == "vertex") header.vertices = count();
    if (keyword == "element" && name == "range_grid") header.cells = count();
    if (keyword == "property" && element == "vertex") ++header.properties;
  }
  return header;
}

bool read_points(Words& text, const GridHeader& header, RangeGrid& grid) {
  grid.points.reserve(static_cast<std::size_t>(header.vertices));
  for (int i = 0; i < header.vertices; ++i) {
    Eigen::Vector3d p;
    for (int k = 0; k < header.properties; ++k) {
      const double value = text.number();
      if (k < 3) p[k] = kMmPerMetre * value;
    }
    if (!p.allFinite()) return false;
    grid.points.push_back(p);
  }
  return true;
}

bool read_cells(Words& text, const GridHeader& header, RangeGrid& grid) {
  grid.cells.reserve(static_cast<std::size_t>(header.cells));
  for (int i = 0; i < header.cells; ++i) {
    const double count = text.number();
    const double index = count == 1.0 ? text.number() : -1.0;
    if ((count != 0.0 && count != 1.0) || !(index < header.vertices) || (count == 1.0 && index < 0.0)) return false;
    grid.cells.push_back(static_cast<int>(index));
  }
  return true;
}

}  // namespace

Result<std::vector<PlacedScan>> read_stanford_conf(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  std::vector<PlacedScan> scans;
  Words lines(*text);
  for (int number = 1; !lines.at_end(); ++number) {
    Words line(lines.next_line());
    if (line.next() != "bmesh") continue;
    PlacedScan scan;
    scan.file = file.parent_path() / line.next();
    Eigen::Vector3d t;
    Eigen::Vector4d q;  // x y z w
    for (double& value : t) value = line.number();
    for (double& value : q) value = line.number();
    if (!t.allFinite() || !(std::abs(q.norm() - 1.0) < 1e-2) || !line.at_end()) {
      return fail(ErrorCode::invalid_input, "{}:{}: not \"bmesh NAME tx ty tz qx qy qz qw\" with a unit quaternion",
                  file.string(), number);
    }
    scan.world_from_scan.linear() = Eigen::Quaterniond(q).normalized().toRotationMatrix().transpose();
    scan.world_from_scan.translation() = kMmPerMetre * t;
    scans.push_back(scan);
  }
  if (scans.empty()) return fail(ErrorCode::invalid_input, "{}: holds no bmesh line", file.string());
  return scans;
}

Result<RangeGrid> read_range_grid(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return pass_on(bytes);
  if (!bytes->starts_with("ply")) return fail(ErrorCode::invalid_input, "{}: not a PLY file", file.string());
  Words text(*bytes);
  const GridHeader header = read_header(text);
  if (!header.ascii) return fail(ErrorCode::unsupported, "{}: only ASCII PLY range grids are read", file.string());
  RangeGrid grid{header.cols, header.rows, {}, {}};
  const double size = 1.0 * header.cols * header.rows;
  if (size == 0.0 || size != header.cells || header.properties < 3) {
    return fail(ErrorCode::invalid_input, "{}: holds no range grid of num_cols x num_rows", file.string());
  }
  if (!read_points(text, header, grid) || !read_cells(text, header, grid)) {
    return fail(ErrorCode::invalid_input, "{}: truncated, or a number that cannot be read", file.string());
  }
  return grid;
}

}  // namespace scanrig
