#include "pipeline/calibrate/find_boards.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"
#include "core/units.h"
#include "pipeline/calibration/corners/find_board.h"
#include "pipeline/calibration/corners/image_checks.h"

namespace scanrig {
namespace {

constexpr std::size_t kBlock = 8;  ///< images between two reports of progress

struct ImageResult {
  cv::Size size;
  std::vector<CornerObservation> corners;
  std::vector<Eigen::Vector2d> outline;
  std::vector<ImageRemark> remarks;
  bool is_other_board = false;
};

ImageResult look(const CalibrationPair& pair, std::size_t side, const std::string& format, const Board& board) {
  ImageResult result;
  const auto leave_out = [&](const std::string& why) { result.remarks.push_back({pair.name, side, why, true}); };
  const auto image = load_calibration_image(pair, side);
  if (!image) {
    leave_out(image.error().message);
    return result;
  }
  result.size = image->size();
  auto found = find_board(*image, format, board);
  if (!found) {
    result.is_other_board = found.error().code == ErrorCode::invalid_input;
    leave_out(found.error().message);
    return result;
  }
  result.outline.assign(found->outline.begin(), found->outline.end());
  bool is_usable = true;
  for (const ImageCheck& check : check_board_image(*found, board, result.size)) {
    const std::string& what = check.spoils_corners ? check.message : check.remark;
    result.remarks.push_back({pair.name, side, what, check.spoils_corners});
    is_usable = is_usable && !check.spoils_corners;
  }
  if (is_usable) result.corners = std::move(found->corners);
  return result;
}

Result<std::vector<ImageResult>> look_at_all(const CalibrationImages& images, const std::string& format,
                                             const Board& board, const Context& context) {
  std::vector<ImageResult> results(2 * images.pairs.size());
  for (std::size_t first = 0; first < results.size(); first += kBlock) {
    if (context.stopped()) return fail(ErrorCode::stopped, "calibration: stopped on request");
    context.report("boards", static_cast<double>(first) / static_cast<double>(results.size()));
    parallel_for(std::min(kBlock, results.size() - first), [&](std::size_t i) {
      const std::size_t image = first + i;
      results[image] = look(images.pairs[image / 2], image % 2, format, board);
    });
  }
  context.report("boards", 1.0);
  return results;
}

/// The first image's size, if all have it.
Result<cv::Size> common_size(const CalibrationImages& images, const std::vector<ImageResult>& results) {
  cv::Size size;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].size.area() == 0) continue;
    if (size.area() == 0) size = results[i].size;
    if (results[i].size == size) continue;
    return fail(ErrorCode::invalid_input, "{}: has {}x{} pixels, the images before it {}x{}; use images of one size",
                images.pairs[i / 2].files[i % 2].string(), results[i].size.width, results[i].size.height, size.width,
                size.height);
  }
  return size;
}

}  // namespace

std::map<std::string, std::vector<ImageRemark>> remarks_on_used_images(const FoundBoards& boards) {
  std::map<std::string, std::vector<ImageRemark>> found;
  for (const ImageRemark& remark : boards.remarks) {
    if (!remark.is_left_out) found[remark.message].push_back(remark);
  }
  return found;
}

Result<FoundBoards> find_boards(const CalibrationImages& images, const std::string& pixel_format, const Board& board,
                                const Context& context) {
  auto results = look_at_all(images, pixel_format, board, context);
  if (!results) return pass_on(results);
  const auto size = common_size(images, *results);
  if (!size) return pass_on(size);
  FoundBoards found;
  found.width = size->width;
  found.height = size->height;
  found.outlines.resize(images.pairs.size());
  for (std::size_t p = 0; p < images.pairs.size(); ++p) {
    const CalibrationPair& pair = images.pairs[p];
    BoardPair& out = found.pairs.emplace_back();
    out.name = pair.name;
    out.placement = pair.placement;
    out.in_a = pair.in_a;
    out.in_b = pair.in_b;
    out.angle_rad = to_radians(pair.table_deg.value_or(0.0));
    for (std::size_t side = 0; side < 2; ++side) {
      ImageResult& result = (*results)[2 * p + side];
      (side == 0 ? out.left : out.right).corners = std::move(result.corners);
      found.outlines[p][side] = std::move(result.outline);
      std::ranges::move(result.remarks, std::back_inserter(found.remarks));
    }
  }
  const auto has_board = [](const BoardPair& pair) {
    return !pair.left.corners.empty() || !pair.right.corners.empty();
  };
  if (std::ranges::any_of(found.pairs, has_board)) return found;
  const bool is_other = std::ranges::any_of(*results, &ImageResult::is_other_board);
  return fail(is_other ? ErrorCode::invalid_input : ErrorCode::not_found, "{}: no image shows the board: {}",
              images.folder.string(), found.remarks.empty() ? "there are none" : found.remarks.front().message);
}

}  // namespace scanrig
