#include "daemon/ctl/output.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
using nlohmann::json;

ExitCode report_error(const RequestError& error) { return report_error(error.exit, error.message); }

void print(const json& answer) { fmt::print("{}\n", answer.dump(2, ' ', false, json::error_handler_t::replace)); }

std::string text(const json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_string() ? object[key].get<std::string>()
                                                                               : std::string();
}

std::string bytes_text(double bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  std::size_t unit = 0;
  for (; bytes >= 1024.0 && unit + 1 < std::size(kUnits); ++unit) bytes /= 1024.0;
  return fmt::format("{:.{}f} {}", bytes, unit == 0 ? 0 : 1, kUnits[unit]);
}

ExitCode report_error(const Error& error) { return report_error(exit_code(error.code), error.message); }

ExitCode report_error(ExitCode code, const std::string& message) {
  std::fflush(stdout);
  fmt::print(stderr, "scanrig: {}\n", message);
  return code;
}

Error of_device(Error error) {
  if (error.code == ErrorCode::io || error.code == ErrorCode::not_found) error.code = ErrorCode::timeout;
  return error;
}

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
