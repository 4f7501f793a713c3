// scanrig-edge-camera: two cameras with a trigger input, in the virtual machine of ./dev hil.
//
//   scanrig-edge-camera IMAGES (lines DOTS PLAIN | lightcrafter PORT) (v4l2 LEFT RIGHT | gige LEFT RIGHT)
//
// IMAGES is a rendered scan folder; its pose 1 is shown. An edge exposes both cameras: 12 ms later each delivers one
// frame, of the view at the table's angle and of the light that was on.
//   lines         files that hold the trigger lines' levels (gpio-sim's `value`)
//   lightcrafter  a LightCrafter 4500 behind USB/IP at this port of 127.0.0.1; its trigger output is the edge
//   v4l2          v4l2loopback devices: their readers get the written frames, one frame per write
//   gige          addresses of two GigE Vision cameras
// The angle comes in degrees, one per line, on the standard input; at its end the program ends.

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iostream>
#include <thread>
#include <utility>
#include <vector>

#include "core/files.h"
#include "core/image_codec.h"
#include "sim/wire/gige_camera.h"
#include "sim/wire/usbip_server.h"

namespace scanrig::sim::wire {
namespace {

constexpr auto kLook = std::chrono::milliseconds(1);  // polling of the lines: gpio-sim signals no edges
constexpr auto kExposure = std::chrono::milliseconds(12);

using Edge = std::function<void(bool pattern)>;

/// The cameras' view: the images of one pose, and the table's angle.
class Sight {
 public:
  explicit Sight(const std::filesystem::path& folder) {
    for (;;) {
      const auto view = folder / "pose1" / fmt::format("view{:02}", views_.size());
      if (!std::filesystem::is_directory(view)) return;
      const auto image = [&](const char* name) {
        const auto bytes = read_file(view / name);
        return bytes ? decode_png(*bytes).value_or(cv::Mat()) : cv::Mat();
      };
      views_.push_back({{image("left_pattern.png"), image("right_pattern.png")},
                        {image("left_plain.png"), image("right_plain.png")}});
    }
  }
  [[nodiscard]] bool empty() const { return views_.empty(); }
  [[nodiscard]] cv::Size size() const { return views_.front().plain[0].size(); }
  void turn_to(double degrees) { angle_deg_ = degrees; }
  [[nodiscard]] const cv::Mat& image(std::size_t side, bool pattern) const {
    const auto count = static_cast<long>(views_.size());
    const long nearest = std::lround(angle_deg_ * static_cast<double>(count) / 360.0) % count;
    const View& view = views_[static_cast<std::size_t>((nearest + count) % count)];
    return (pattern ? view.pattern : view.plain)[side];
  }

 private:
  struct View {
    std::array<cv::Mat, 2> pattern, plain;  // left, right
  };
  std::vector<View> views_;
  std::atomic<double> angle_deg_ = 0;
};

/// A trigger line, with detection of a rise since the last poll.
class TriggerLine {
 public:
  explicit TriggerLine(const std::string& value_file) : descriptor_(::open(value_file.c_str(), O_RDONLY | O_CLOEXEC)) {}
  [[nodiscard]] bool there() const { return descriptor_ >= 0; }
  bool has_risen() {
    char level = '0';
    const bool high = ::pread(descriptor_, &level, 1, 0) == 1 && level == '1';
    return !std::exchange(high_, high) && high;
  }

 private:
  int descriptor_;
  bool high_ = false;
};

void watch_lines(TriggerLine dots, TriggerLine plain, const Edge& edge, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (dots.has_risen()) edge(true);
    if (plain.has_risen()) edge(false);
    std::this_thread::sleep_for(kLook);
  }
}

Result<int> open_video(const std::string& device, cv::Size size) {
  const int descriptor = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<std::uint32_t>(size.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(size.height);
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_SRGGB8;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.sizeimage = static_cast<std::uint32_t>(size.area());
  if (descriptor < 0 || ::ioctl(descriptor, VIDIOC_S_FMT, &format) < 0) {
    return fail(ErrorCode::io, "{}: {}", device, std::strerror(errno));
  }
  // Nothing can be read before the first write: a dark frame, as of a sensor after power-on.
  const std::vector<std::uint8_t> dark(static_cast<std::size_t>(size.area()));
  if (::write(descriptor, dark.data(), dark.size()) < 0)
    return fail(ErrorCode::io, "{}: the device accepts no frame", device);
  return descriptor;
}

Result<Edge> video_cameras(const std::array<std::string, 2>& devices, const Sight& sight) {
  std::array<int, 2> descriptors{};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto opened = open_video(devices[side], sight.size());
    if (!opened) return pass_on(opened);
    descriptors[side] = *opened;
  }
  return [descriptors, &sight](bool pattern) {
    std::this_thread::sleep_for(kExposure);
    for (std::size_t side = 0; side < 2; ++side) {
      const cv::Mat& image = sight.image(side, pattern);
      if (::write(descriptors[side], image.data, image.total()) < 0) std::perror("scanrig-edge-camera: write a frame");
    }
  };
}

Result<Edge> gige_cameras(const std::array<std::string, 2>& addresses, const Sight& sight, Clock& clock) {
  GigeCamerasOptions options;
  options.left_address = addresses[0];
  options.right_address = addresses[1];
  options.size = sight.size();
  options.frame_after = kExposure;
  options.numbered = false;
  const auto show = [&sight](Side side, const GigeExposure& exposure, cv::Mat& image) {
    sight.image(side == Side::left ? 0 : 1, exposure.pattern).copyTo(image);
  };
  auto cameras = GigeCameras::start(options, show, clock);
  if (!cameras) return pass_on(cameras);
  return [cameras = std::shared_ptr(std::move(*cameras))](bool pattern) { cameras->edge(pattern); };
}

Result<void> run(const std::vector<std::string>& words) {
  Sight sight(words[0]);
  if (sight.empty()) return fail(ErrorCode::not_found, "{}: no views", words[0]);
  RealClock clock;
  const std::size_t cameras = words[1] == "lines" ? 4 : 3;
  const std::array<std::string, 2> ends{words[cameras + 1], words[cameras + 2]};
  const auto edge = words[cameras] == "gige" ? gige_cameras(ends, sight, clock) : video_cameras(ends, sight);
  if (!edge) return pass_on(edge);

  LightCrafter projector(clock);
  std::unique_ptr<UsbIpServer> cable;
  std::jthread watch;
  if (words[1] == "lines") {
    TriggerLine dots(words[2]), plain(words[3]);
    if (!dots.there() || !plain.there()) return fail(ErrorCode::not_found, "{}, {}: no such line", words[2], words[3]);
    watch = std::jthread([&, dots, plain](const std::stop_token& stop) { watch_lines(dots, plain, *edge, stop); });
  } else {
    projector.on_trigger_out([&](const LightCrafter::Flash& flash) { (*edge)(!flash.white); });
    auto server = UsbIpServer::start(static_cast<std::uint16_t>(std::stoi(words[2])), projector);
    if (!server) return pass_on(server);
    cable = std::move(*server);
  }
  for (double degrees = 0; std::cin >> degrees;) sight.turn_to(degrees);
  return {};
}

}  // namespace
}  // namespace scanrig::sim::wire

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const std::size_t wanted = words.size() > 1 && words[1] == "lines" ? 7 : 6;
  if (words.size() != wanted) {
    std::cerr << "usage: scanrig-edge-camera IMAGES (lines DOTS PLAIN | lightcrafter PORT) (v4l2 | gige) LEFT RIGHT\n";
    return static_cast<int>(scanrig::ExitCode::usage);
  }
  const auto done = scanrig::sim::wire::run(words);
  if (done) return 0;
  std::cerr << "scanrig-edge-camera: " << done.error().message << '\n';
  return static_cast<int>(exit_code(done.error().code));
}
