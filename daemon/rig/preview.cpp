#include "daemon/rig/preview.h"

#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/image_codec.h"
#include "pipeline/storage/calibration_file.h"

namespace scanrig {
namespace {

constexpr auto kBeforeRetry = std::chrono::seconds(2);  ///< after cameras that did not respond
constexpr int kQuality = 80, kFocusQuality = 95;        ///< of the JPEG, per cent
constexpr int kFocusPx = 512;
constexpr auto kBetweenLooks = std::chrono::milliseconds(500);  ///< at the board

/// Begins at an even pixel: the colours of a sensor repeat every two.
cv::Mat middle_of(const cv::Mat& image) {
  const auto even = [](int pixels) { return pixels / 2 * 2; };
  const int width = std::min(kFocusPx, image.cols), height = std::min(kFocusPx, image.rows);
  return image({even((image.cols - width) / 2), even((image.rows - height) / 2), width, height});
}

Result<std::string> encode(const cv::Mat& image, PixelFormat format, int quality) {
  try {
    cv::Mat colour = image;
    if (format == PixelFormat::bayer_rggb8) cv::cvtColor(image, colour, cv::COLOR_BayerRGGB2BGR);
    const auto bytes = encode_jpeg(colour, quality);
    if (!bytes) return pass_on(bytes, "preview");
    return std::string(as_text(*bytes));
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "preview: {}", error.what());
  }
}

}  // namespace

Result<std::string> Preview::jpeg(Side side, Extent extent) {
  const bool quiet = quiet_();
  std::unique_lock lock(mutex_);
  if (auto there = look(quiet); !there) return pass_on(there);
  Encoded& encoded = encoded_[static_cast<std::size_t>(side)];
  const bool is_whole = extent == Extent::whole;
  if (is_whole && encoded.pair == pairs_) return encoded.bytes;
  const std::uint64_t pair = pairs_;
  const cv::Mat image = side == Side::left ? latest_.left : latest_.right;
  const PixelFormat format = latest_.format;
  lock.unlock();
  auto bytes = is_whole ? encode(image, format, kQuality) : encode(middle_of(image), format, kFocusQuality);
  lock.lock();
  if (bytes && is_whole) encoded = {pair, *bytes};
  return bytes;
}

Result<StereoFrame> Preview::latest() {
  const bool quiet = quiet_();
  const std::scoped_lock lock(mutex_);
  if (auto there = look(quiet); !there) return pass_on(there);
  return latest_;
}

/// Requests a newer pair, and checks that there is one.
Result<void> Preview::look(bool quiet) {
  if (quiet) ask_for_more();
  // Where only the projector's edge exposes, the latest exposure stays.
  const bool blind = problem_ && (problem_->code != ErrorCode::unsupported || pairs_ == 0);
  if (quiet && blind) return tl::unexpected(*problem_);
  if (pairs_ == 0) return fail(ErrorCode::not_found, "preview: the cameras have taken no image yet; try again");
  return {};
}

/// Takes one preview at a time.
void Preview::ask_for_more() {
  if (!look_ || asked_ || clock_.now() < not_before_) return;
  asked_ = true;
  look_();
}

void Preview::on_wanted(std::function<void()> look) {
  const std::scoped_lock lock(mutex_);
  look_ = std::move(look);
}

void Preview::keep(const StereoFrame& pair) {
  const std::scoped_lock lock(mutex_);
  latest_ = pair;
  ++pairs_;
  asked_ = false;
  problem_.reset();
}

void Preview::failed(const Error& error) {
  const std::scoped_lock lock(mutex_);
  problem_ = error;
  asked_ = false;
  not_before_ = clock_.now() + kBeforeRetry;
}

Result<PlacementView> PlacementAid::look(const AwaitedPlacement& awaited) {
  const auto pair = preview_.latest();  // also requests the next one
  if (!pair) return pass_on(pair);
  const std::scoped_lock lock(mutex_);
  if (seen_ && seen_for_ == awaited && clock_.now() < not_before_) return *seen_;
  const auto calibration = read_calibration(calibration_file_);
  const auto& plan = calibration_plan();
  seen_ = compare_placement(pair->left, pair->right, to_string(pair->format), board_,
                            plan.at(static_cast<std::size_t>(awaited.placement)), calibration ? &*calibration : nullptr,
                            awaited.table_deg);
  seen_for_ = awaited;
  not_before_ = clock_.now() + kBetweenLooks;
  return *seen_;
}

}  // namespace scanrig
