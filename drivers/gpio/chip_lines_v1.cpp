#include <gpiod.h>
#include <poll.h>

#include <cerrno>
#include <cstring>

#include "drivers/gpio/lines.h"

namespace scanrig::gpio {
namespace {

constexpr const char* kConsumer = "scanrig";

struct Closer {
  void operator()(gpiod_line* line) const { gpiod_line_close_chip(line); }
};
using LinePtr = std::unique_ptr<gpiod_line, Closer>;

int flags(const LineSpec& line) {
  int flags = line.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  switch (line.bias) {
    case Bias::as_is: break;
    case Bias::disabled: flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE; break;
    case Bias::pull_up: flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP; break;
    case Bias::pull_down: flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN; break;
  }
  return flags;
}

/// The line owns its chip: both are closed by Closer.
Result<LinePtr> find_on_chip(const LineSpec& line) {
  gpiod_chip* const chip = gpiod_chip_open_lookup(line.chip.c_str());
  if (!chip) return fail(ErrorCode::not_found, "gpio: no chip {}; gpiodetect lists those there are", line.chip);
  LinePtr found(gpiod_chip_get_line(chip, line.offset));
  if (found) return found;
  const unsigned count = gpiod_chip_num_lines(chip);
  gpiod_chip_close(chip);
  return fail(ErrorCode::not_found, "gpio: {} has no offset {}, only 0 to {}", line.chip, line.offset, count - 1);
}

Result<LinePtr> find(const LineSpec& line) {
  if (line.name.empty()) return find_on_chip(line);
  LinePtr found(gpiod_line_find(line.name.c_str()));
  if (!found) return fail(ErrorCode::not_found, "gpio: no chip has a line named {}", line.name);
  return found;
}

tl::unexpected<Error> failed(const std::string& what) {
  return fail(ErrorCode::io, "gpio: {}: {}", what, std::strerror(errno));
}

class ChipOutput final : public Output {
 public:
  ChipOutput(LinePtr line, LineSpec spec) : line_(std::move(line)), spec_(std::move(spec)) {}
  ~ChipOutput() override {
    if (!spec_.keep) gpiod_line_set_value(line_.get(), 0);
  }

  Result<void> set(bool active) override {
    if (gpiod_line_set_value(line_.get(), active ? 1 : 0) != 0) return failed("set " + spec_.contact());
    return {};
  }

 private:
  LinePtr line_;
  LineSpec spec_;
};

class ChipInputs final : public Inputs {
 public:
  ChipInputs(std::vector<LinePtr> lines, Clock& clock) : lines_(std::move(lines)), clock_(clock) {}

  Result<std::vector<bool>> wait_change(const std::vector<bool>& known, Deadline deadline) override {
    for (;;) {
      std::vector<bool> levels;
      std::vector<pollfd> watched;
      for (const auto& line : lines_) {
        const int value = gpiod_line_get_value(line.get());
        if (value < 0) return failed("read an input");
        levels.push_back(value == 1);
        watched.push_back({gpiod_line_event_get_fd(line.get()), POLLIN, 0});
      }
      if (levels != known || deadline.expired(clock_)) return levels;
      const auto wait = std::chrono::ceil<std::chrono::milliseconds>(deadline.left(clock_)).count();
      if (::poll(watched.data(), watched.size(), static_cast<int>(std::min<long>(wait, 60'000))) < 0 &&
          errno != EINTR) {
        return failed("wait for an input");
      }
      for (std::size_t i = 0; i < watched.size(); ++i) {
        gpiod_line_event event;
        if ((watched[i].revents & POLLIN) && gpiod_line_event_read(lines_[i].get(), &event) != 0) {
          return failed("read an edge");
        }
      }
    }
  }

 private:
  std::vector<LinePtr> lines_;
  Clock& clock_;
};

class ChipLines final : public Lines {
 public:
  explicit ChipLines(Clock& clock) : clock_(clock) {}

  Result<std::unique_ptr<Output>> output(const LineSpec& spec) override {
    auto line = find(spec);
    if (!line) return pass_on(line);
    if (gpiod_line_request_output_flags(line->get(), kConsumer, flags(spec), 0) != 0)
      return failed("use " + spec.contact());
    return std::make_unique<ChipOutput>(std::move(*line), spec);
  }

  Result<std::unique_ptr<Inputs>> inputs(const std::vector<LineSpec>& specs) override {
    std::vector<LinePtr> lines;
    for (const auto& spec : specs) {
      auto line = find(spec);
      if (!line) return pass_on(line);
      if (gpiod_line_request_both_edges_events_flags(line->get(), kConsumer, flags(spec)) != 0) {
        return failed("use " + spec.contact());
      }
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
