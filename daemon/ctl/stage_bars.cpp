#include "daemon/ctl/stage_bars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scanrig::ctl {

std::string bar(std::string_view name, double fraction) {
  constexpr int kWidth = 30;
  const double share = std::clamp(fraction, 0.0, 1.0);
  const int full = static_cast<int>(std::floor(share * kWidth));
  return fmt::format("  {:<22} [{}{}] {:3.0f} %", name, std::string(full, '#'), std::string(kWidth - full, '-'),
                     std::floor(share * 100.0));
}

std::string bar(std::string_view name, double fraction, Clock::Duration spent) {
  return fmt::format("{} {:7.1f} s", bar(name, fraction), std::chrono::duration<double>(spent).count());
}

void StageBars::line(std::string_view text) {
  clear();
  fmt::print(out_, "{}\n", text);
  std::fflush(out_);
}

void StageBars::update(const std::string& name, double fraction) {
  auto& stage = stages_.try_emplace(name, Stage{clock_.now()}).first->second;
  stage.fraction = fraction;
  if (stage.written) return;
  if (fraction >= 1.0) {
    write(name, stage);
  } else {
    draw(name, stage);
  }
}

void StageBars::end(bool success) {
  for (auto& [name, stage] : stages_) {
    if (stage.written) continue;
    if (success) stage.fraction = 1.0;
    write(name, stage);
  }
  clear();
}

void StageBars::write(const std::string& name, Stage& stage) {
  stage.written = true;
  line(bar(name, stage.fraction, clock_.now() - stage.begun));
}

void StageBars::draw(const std::string& name, const Stage& stage) {
  if (!terminal_) return;
  fmt::print(out_, "\r\x1b[K{}", bar(name, stage.fraction, clock_.now() - stage.begun));
  std::fflush(out_);
  drawn_ = true;
}

void StageBars::clear() {
  if (!drawn_) return;
  fmt::print(out_, "\r\x1b[K");
  std::fflush(out_);
  drawn_ = false;
}

}  // namespace scanrig::ctl
