#include "drivers/discovery/panel_wiring.h"

#include <algorithm>
#include <chrono>
#include <functional>

namespace scanrig::discovery {
namespace {

using std::chrono::milliseconds;

constexpr int kMaxChannels = 64;
constexpr int kMissedReplies = 5;
constexpr milliseconds kRequestLimit{500};
constexpr milliseconds kBetweenReadings{30};

}  // namespace

std::vector<std::string> readable_lines(gpio::Lines& lines, const std::vector<std::string>& names) {
  std::vector<std::string> found;
  for (const auto& name : names) {
    if (lines.inputs({{.name = name}})) found.push_back(name);
  }
  return found;
}

Result<int> IoModuleProbe::count(const std::function<Result<std::vector<bool>>(int)>& read) {
  auto first = read(1);
  if (!first) return pass_on(first);
  int channels = 1;
  // A module refuses a span that reaches beyond its last channel.
  for (int step = kMaxChannels / 2; step > 0; step /= 2) {
    if (channels + step <= kMaxChannels && read(channels + step)) channels += step;
  }
  return channels;
}

Result<void> IoModuleProbe::begin() {
  const auto limit = [this] { return Deadline::after(clock_, kRequestLimit); };
  const auto inputs = count([&](int span) { return client_.read_inputs(0, span, limit()); });
  if (!inputs) return pass_on(inputs);
  const auto outputs = count([&](int span) { return client_.read_coils(0, span, limit()); });
  outputs_ = outputs.value_or(0);
  rest_.resize(static_cast<std::size_t>(*inputs));
  auto now = read();
  if (!now) return pass_on(now);
  rest_ = *std::move(now);
  return {};
}

Result<std::vector<bool>> IoModuleProbe::read() {
  for (int missed = 0;; ++missed) {
    auto now = client_.read_inputs(0, inputs(), Deadline::after(clock_, kRequestLimit));
    if (now || missed == kMissedReplies) return now;
  }
}

Result<std::optional<ChangedInput>> IoModuleProbe::wait_for_change(Deadline deadline) {
  while (!deadline.expired(clock_)) {
    const auto now = read();
    if (!now) return pass_on(now);
    std::optional<ChangedInput> changed;
    int changes = 0;
    for (int channel = 0; channel < inputs(); ++channel) {
      const auto i = static_cast<std::size_t>(channel);
      if ((*now)[i] == rest_[i]) continue;
      ++changes;
      changed = ChangedInput{channel, (*now)[i]};
    }
    if (changes == 1) return changed;
    clock_.sleep_for(kBetweenReadings);
  }
  return std::optional<ChangedInput>();
}

Result<bool> IoModuleProbe::wait_for_rest(Deadline deadline) {
  while (!deadline.expired(clock_)) {
    const auto now = read();
    if (!now) return pass_on(now);
    if (*now == rest_) return true;
    clock_.sleep_for(kBetweenReadings);
  }
  return false;
}

Result<void> IoModuleProbe::set_output(int channel, bool on) {
  return client_.write_coil(static_cast<std::uint16_t>(channel), on, Deadline::after(clock_, kRequestLimit));
}

}  // namespace scanrig::discovery
