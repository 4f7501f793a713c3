#include "config/setup/camera_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "core/files.h"
#include "core/image_codec.h"
#include "drivers/camera/aravis_stereo_camera.h"

namespace scanrig::config::setup {
namespace {

constexpr std::chrono::seconds kLimit{20};      ///< for connecting two cameras and their first exposures
constexpr std::chrono::seconds kFrameLimit{4};  ///< far above any camera's transfer: nothing is known of it yet
constexpr std::chrono::milliseconds kLong{40};  ///< exposure: room light is enough to tell what is in view
constexpr int kWidth = 640, kQuality = 80;
constexpr double kBright = 0.98;  ///< this share of the pixels stays below full scale
constexpr int kFullScale = 255;

/// The grey value below which `kBright` of the pixels are.
int bright_level(const cv::Mat& image) {
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  std::array<int, kFullScale + 1> counts{};
  for (const auto value : cv::Mat1b(grey)) ++counts.at(value);
  const auto wanted = kBright * static_cast<double>(grey.total());
  double below = 0;
  for (int level = 0; level <= kFullScale; ++level) {
    below += counts.at(static_cast<std::size_t>(level));
    if (below >= wanted) return std::max(level, 1);
  }
  return kFullScale;
}

Result<std::string> write_image(const cv::Mat& image, PixelFormat format, const std::filesystem::path& file) {
  try {
    cv::Mat colour = image;
    if (format == PixelFormat::bayer_rggb8) cv::cvtColor(image, colour, cv::COLOR_BayerRGGB2BGR);
    if (format == PixelFormat::mono8) cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
    const double scale = std::min(1.0, static_cast<double>(kWidth) / colour.cols);
    cv::Mat small;
    cv::resize(colour, small, {}, scale, scale, cv::INTER_AREA);
    small.convertTo(small, -1, static_cast<double>(kFullScale) / bright_level(small));
    const auto bytes = encode_jpeg(small, kQuality);
    if (!bytes) return pass_on(bytes);
    if (auto written = write_file_atomically(file, as_text(*bytes)); !written) return pass_on(written);
    return file.string();
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::internal, "setup: {}", error.what());
  }
}

}  // namespace

CameraImages take_images(const std::vector<FoundCamera>& cameras, const std::string& pixel_format,
                         const std::filesystem::path& folder, Clock& clock) {
  CameraImages images{std::vector<std::string>(cameras.size()), ""};
  if (auto made = create_directories_synced(folder); !made) {
    images.trouble = made.error().message;
    return images;
  }
  const auto keep = [&](const cv::Mat& image, PixelFormat format, std::size_t i) {
    auto written = write_image(image, format, folder / fmt::format("camera{}.jpg", i + 1));
    if (written) {
      images.files[i] = *std::move(written);
    } else {
      images.trouble = written.error().message;
    }
  };
  for (std::size_t i = 0; i + 1 < cameras.size(); i = i + 3 == cameras.size() ? i + 1 : i + 2) {
    AravisOptions pair;
    pair.left.serial = cameras[i].serial;
    pair.right.serial = cameras[i + 1].serial;
    pair.trigger_source = "Software";
    pair.pixel_format = pixel_format;
    pair.exposure = kLong;
    pair.frame_timeout = kFrameLimit;
    const auto by = Deadline::after(clock, kLimit);
    const auto opened = open_aravis(pair, clock, by);
    const auto seen = opened ? (*opened)->capture_preview(by) : Result<StereoFrame>(pass_on(opened));
    if (!seen) {
      images.trouble = seen.error().message;
      continue;
    }
    keep(seen->left, seen->format, i);
    keep(seen->right, seen->format, i + 1);
  }
  return images;
}

}  // namespace scanrig::config::setup
