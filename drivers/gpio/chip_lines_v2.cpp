#include <gpiod.h>
#include <poll.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <tuple>

#include "drivers/gpio/lines.h"

namespace scanrig::gpio {
namespace {

constexpr const char* kConsumer = "scanrig";
constexpr std::size_t kEvents = 16;

template <auto release>
struct Release {
  template <class T>
  void operator()(T* object) const {
    release(object);
  }
};
using Chip = std::unique_ptr<gpiod_chip, Release<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Release<gpiod_chip_info_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, Release<gpiod_line_settings_free>>;
using Config = std::unique_ptr<gpiod_line_config, Release<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Release<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, Release<gpiod_line_request_release>>;
using Events = std::unique_ptr<gpiod_edge_event_buffer, Release<gpiod_edge_event_buffer_free>>;

tl::unexpected<Error> failed(const std::string& what) {
  return fail(ErrorCode::io, "gpio: {}: {}", what, std::strerror(errno));
}

/// A line in use: its request and its number on the chip.
struct Line {
  Request request;
  unsigned offset = 0;
};

gpiod_line_bias bias(const LineSpec& line) {
  switch (line.bias) {
    case Bias::as_is: break;
    case Bias::disabled: return GPIOD_LINE_BIAS_DISABLED;
    case Bias::pull_up: return GPIOD_LINE_BIAS_PULL_UP;
    case Bias::pull_down: return GPIOD_LINE_BIAS_PULL_DOWN;
  }
  return GPIOD_LINE_BIAS_AS_IS;
}

Result<Line> request_offset(gpiod_chip* chip, unsigned offset, const LineSpec& line, bool output) {
  const Settings settings(gpiod_line_settings_new());
  const Config config(gpiod_line_config_new());
  const RequestConfig request_config(gpiod_request_config_new());
  if (!settings || !config || !request_config) return failed("use " + line.contact());
  gpiod_line_settings_set_active_low(settings.get(), line.active_low);
  gpiod_line_settings_set_direction(settings.get(), output ? GPIOD_LINE_DIRECTION_OUTPUT : GPIOD_LINE_DIRECTION_INPUT);
  gpiod_line_settings_set_bias(settings.get(), bias(line));
  if (!output) gpiod_line_settings_set_edge_detection(settings.get(), GPIOD_LINE_EDGE_BOTH);
  gpiod_request_config_set_consumer(request_config.get(), kConsumer);
  Line found{nullptr, offset};
  if (gpiod_line_config_add_line_settings(config.get(), &found.offset, 1, settings.get()) != 0) {
    return failed("use " + line.contact());
  }
  found.request.reset(gpiod_chip_request_lines(chip, request_config.get(), config.get()));
  if (!found.request) return failed("use " + line.contact());
  return found;
}

/// Number of the line on this chip; nothing if it is on another. Fails with `not_found`: the chip has fewer lines.
Result<std::optional<unsigned>> offset_on(gpiod_chip* chip, const LineSpec& line) {
  if (!line.name.empty()) {
    const int offset = gpiod_chip_get_line_offset_from_name(chip, line.name.c_str());
    return offset < 0 ? std::nullopt : std::optional(static_cast<unsigned>(offset));
  }
  const ChipInfo info(gpiod_chip_get_info(chip));
  if (!info ||
      (gpiod_chip_info_get_name(info.get()) != line.chip && gpiod_chip_info_get_label(info.get()) != line.chip))
    return std::nullopt;
  const std::size_t count = gpiod_chip_info_get_num_lines(info.get());
  if (line.offset < count) return line.offset;
  return fail(ErrorCode::not_found, "gpio: {} has no offset {}, only 0 to {}", line.chip, line.offset, count - 1);
}

Result<Line> request_line(const LineSpec& line, bool output) {
  std::error_code ignored;
  for (const auto& device : std::filesystem::directory_iterator("/dev", ignored)) {
    if (!gpiod_is_gpiochip_device(device.path().c_str())) continue;
    const Chip chip(gpiod_chip_open(device.path().c_str()));
    if (!chip) continue;
    const auto offset = offset_on(chip.get(), line);
    if (!offset) return pass_on(offset);
    if (*offset) return request_offset(chip.get(), **offset, line, output);
  }
  if (line.name.empty()) {
    return fail(ErrorCode::not_found, "gpio: no chip {}; gpiodetect lists those there are", line.chip);
  }
  return fail(ErrorCode::not_found, "gpio: no chip has a line named {}", line.name);
}

class ChipOutput final : public Output {
 public:
  ChipOutput(Line line, LineSpec spec) : line_(std::move(line)), spec_(std::move(spec)) {}
  ~ChipOutput() override {
    if (!spec_.keep) std::ignore = set(false);
  }

  Result<void> set(bool active) override {
    const auto value = active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    if (gpiod_line_request_set_value(line_.request.get(), line_.offset, value) != 0)
      return failed("set " + spec_.contact());
    return {};
  }

 private:
  Line line_;
  LineSpec spec_;
};

class ChipInputs final : public Inputs {
 public:
  ChipInputs(std::vector<Line> lines, Clock& clock)
      : lines_(std::move(lines)), events_(gpiod_edge_event_buffer_new(kEvents)), clock_(clock) {}

  Result<std::vector<bool>> wait_change(const std::vector<bool>& known, Deadline deadline) override {
    for (;;) {
      std::vector<bool> levels;
      std::vector<pollfd> watched;
      for (const auto& line : lines_) {
        const auto value = gpiod_line_request_get_value(line.request.get(), line.offset);
        if (value == GPIOD_LINE_VALUE_ERROR) return failed("read an input");
        levels.push_back(value == GPIOD_LINE_VALUE_ACTIVE);
        watched.push_back({gpiod_line_request_get_fd(line.request.get()), POLLIN, 0});
      }
      if (levels != known || deadline.expired(clock_)) return levels;
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(deadline.left(clock_)).count();
      if (::poll(watched.data(), watched.size(), static_cast<int>(std::min<long>(wait, 60'000))) < 0 &&
          errno != EINTR) {
        return failed("wait for an input");
      }
      for (std::size_t i = 0; i < watched.size(); ++i) {
        if (!(watched[i].revents & POLLIN)) continue;
        if (gpiod_line_request_read_edge_events(lines_[i].request.get(), events_.get(), kEvents) < 0) {
          return failed("read an edge");
        }
      }
    }
  }

 private:
  std::vector<Line> lines_;
  Events events_;
  Clock& clock_;
};

class ChipLines final : public Lines {
 public:
  explicit ChipLines(Clock& clock) : clock_(clock) {}

  Result<std::unique_ptr<Output>> output(const LineSpec& spec) override {
    auto line = request_line(spec, true);
    if (!line) return pass_on(line);
    return std::make_unique<ChipOutput>(std::move(*line), spec);
  }

  Result<std::unique_ptr<Inputs>> inputs(const std::vector<LineSpec>& specs) override {
    std::vector<Line> lines;
    for (const auto& spec : specs) {
      auto line = request_line(spec, false);
      if (!line) return pass_on(line);
      lines.push_back(std::move(*line));
    }
    return std::make_unique<ChipInputs>(std::move(lines), clock_);
  }

 private:
  Clock& clock_;
};

}  // namespace

std::unique_ptr<Lines> chip_lines(Clock& clock) { return std::make_unique<ChipLines>(clock); }

}  // namespace scanrig::gpio
