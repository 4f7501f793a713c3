// scanrig-edge-camera: two cameras with a trigger input, in the virtual machine of ./dev hil.
//
//   scanrig-edge-camera IMAGES DOTS PLAIN LEFT RIGHT EXPOSURE_MS
//
// IMAGES is a rendered scan folder; of it pose 1 is shown. DOTS and PLAIN are files that hold the trigger lines' levels
// (gpio-sim's `value`), LEFT and RIGHT v4l2loopback devices: what is written there is what their readers get, one frame
// a write. A rising edge exposes both cameras: EXPOSURE_MS later one frame comes from each, of the view that belongs to
// the table's angle and of the light that was on. The angle comes in degrees, one a line, on the standard input; at its
// end the program ends. Says "ready" when both devices deliver.

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <vector>

#include "core/result.h"

namespace scanrig::sim::wire {
namespace {

constexpr auto kLook = std::chrono::milliseconds(1);  // at the lines: gpio-sim tells nobody of an edge

/// The four images of a view, as in its folder.
struct View {
  std::array<cv::Mat, 2> pattern, plain;  // left, right
};

std::vector<View> read_views(const std::filesystem::path& folder) {
  std::vector<View> views;
  for (;;) {
    const auto view = folder / "pose1" / fmt::format("view{:02}", views.size());
    if (!std::filesystem::is_directory(view)) return views;
    const auto image = [&](const char* name) { return cv::imread((view / name).string(), cv::IMREAD_UNCHANGED); };
    views.push_back({{image("left_pattern.png"), image("right_pattern.png")},
                     {image("left_plain.png"), image("right_plain.png")}});
  }
}

Result<int> open_device(const char* device, const cv::Mat& image) {
  const int descriptor = ::open(device, O_RDWR | O_CLOEXEC);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<std::uint32_t>(image.cols);
  format.fmt.pix.height = static_cast<std::uint32_t>(image.rows);
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_SRGGB8;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.sizeimage = static_cast<std::uint32_t>(image.total());
  if (descriptor < 0 || ::ioctl(descriptor, VIDIOC_S_FMT, &format) < 0) {
    return fail(ErrorCode::io, "{}: {}", device, std::strerror(errno));
  }
  return descriptor;
}

/// A trigger line, and whether it has risen since it was looked at.
class TriggerLine {
 public:
  explicit TriggerLine(const char* value_file) : descriptor_(::open(value_file, O_RDONLY | O_CLOEXEC)) {}
  [[nodiscard]] bool there() const { return descriptor_ >= 0; }
  bool has_risen() {
    char level = '0';
    const bool high = ::pread(descriptor_, &level, 1, 0) == 1 && level == '1';
    const bool was_high = std::exchange(high_, high);
    return high && !was_high;
  }

 private:
  int descriptor_;
  bool high_ = false;
};

void expose(const std::array<cv::Mat, 2>& images, const std::array<int, 2>& devices) {
  for (std::size_t side = 0; side < 2; ++side) {
    if (::write(devices[side], images[side].data, images[side].total()) < 0) {
      std::cerr << "scanrig-edge-camera: write a frame: " << std::strerror(errno) << '\n';
    }
  }
}

int run(char** argv) {
  const auto views = read_views(argv[1]);
  TriggerLine dots(argv[2]), plain(argv[3]);
  if (views.empty() || !dots.there() || !plain.there()) {
    std::cerr << "scanrig-edge-camera: no views in " << argv[1] << ", or no trigger lines\n";
    return static_cast<int>(ExitCode::bad_input);
  }
  std::array<int, 2> devices{};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto device = open_device(argv[4 + side], views[0].plain[side]);
    if (!device) {
      std::cerr << "scanrig-edge-camera: " << device.error().message << '\n';
      return static_cast<int>(exit_code(device.error().code));
    }
    devices[side] = *device;
  }
  const auto exposure = std::chrono::milliseconds(std::atoi(argv[6]));
  std::atomic<double> angle = 0;
  std::jthread shutter([&](const std::stop_token& stop) {
    const double step = 360.0 / static_cast<double>(views.size());
    while (!stop.stop_requested()) {
      const bool pattern = dots.has_risen(), even = plain.has_risen();
      if (pattern || even) {
        const auto count = static_cast<long>(views.size());
        const long nearest = std::lround(angle / step) % count;
        const View& view = views[static_cast<std::size_t>((nearest + count) % count)];
        std::this_thread::sleep_for(exposure);
        expose(pattern ? view.pattern : view.plain, devices);
      }
      std::this_thread::sleep_for(kLook);
    }
  });
  std::cout << "ready" << std::endl;
  for (double degrees = 0; std::cin >> degrees;) angle = degrees;
  return 0;
}

}  // namespace
}  // namespace scanrig::sim::wire

int main(int argc, char** argv) {
  if (argc == 7) return scanrig::sim::wire::run(argv);
  std::cerr << "usage: scanrig-edge-camera IMAGES DOTS PLAIN LEFT RIGHT EXPOSURE_MS\n";
  return static_cast<int>(scanrig::ExitCode::usage);
}
