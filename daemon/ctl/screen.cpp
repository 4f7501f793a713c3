#include "daemon/ctl/screen.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace scanrig::ctl {
namespace {

constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l", kLeave = "\x1b[?25h\x1b[?1049l";

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

int points(std::string_view text) {
  return static_cast<int>(std::ranges::count_if(text, [](char c) { return !is_continuation(c); }));
}

/// The bytes of the first `width` letters.
std::size_t bytes_of(std::string_view text, int width) {
  std::size_t i = 0;
  for (int seen = 0; i < text.size(); ++i) {
    if (!is_continuation(text[i]) && ++seen > width) break;
  }
  return i;
}

/// A line that is too long goes on below, further in; it is broken between words where there are any.
void wrap(std::string_view line, int width, std::vector<std::string>& lines) {
  const auto indent = std::min<std::size_t>(line.find_first_not_of(' '), static_cast<std::size_t>(width) / 4);
  std::string margin;
  while (margin.size() + static_cast<std::size_t>(points(line)) > static_cast<std::size_t>(width)) {
    const auto room = width - static_cast<int>(margin.size());
    const auto most = bytes_of(line, room);
    auto end = line.rfind(' ', most);
    if (end == std::string_view::npos || line.find_first_not_of(' ') >= end) end = most;
    lines.push_back(margin + std::string(line.substr(0, end)));
    line.remove_prefix(std::min(line.find_first_not_of(' ', end), line.size()));
    margin.assign(std::min<std::size_t>(indent + 2, static_cast<std::size_t>(width) / 2), ' ');
  }
  if (!line.empty() || margin.empty()) lines.push_back(margin + std::string(line));
}

bool is_terminal(std::FILE* out) {
  const char* kind = std::getenv("TERM");
  return ::isatty(::fileno(out)) == 1 && kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
}

Window window_of(std::FILE* out) {
  winsize size{};
  if (::ioctl(::fileno(out), TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

void write(std::FILE* out, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), out);
  std::fflush(out);
}

}  // namespace

std::vector<std::string> fitted(const std::vector<std::string>& lines, Window window) {
  const auto width = std::max(window.width, 1);
  const auto room = static_cast<std::size_t>(std::max(window.height, 1));
  std::vector<std::string> fit;
  for (const auto& line : lines) wrap(line, width, fit);
  if (fit.size() <= room) return fit;
  const auto missing = fmt::format("({} more lines)", fit.size() - room + 1);
  fit.resize(room - 1);
  fit.push_back(missing.substr(0, bytes_of(missing, width)));
  return fit;
}

Screen::Screen(std::FILE* out) : out_(out), terminal_(is_terminal(out)) {
  if (terminal_) write(out_, kEnter);
}

Screen::~Screen() {
  if (terminal_) write(out_, kLeave);
}

void Screen::show(const std::vector<std::string>& lines) {
  std::string text;
  if (terminal_) {
    const auto window = window_of(out_);
    const auto fit = fitted(lines, window);
    if (fit == shown_) return;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      text += (i == 0 ? "\x1b[H" : "\r\n") + fit[i];
      // Behind a line that is full the cursor still stands on its last letter, which would be erased.
      if (points(fit[i]) < window.width) text += "\x1b[K";
    }
    const bool full = !fit.empty() && points(fit.back()) >= window.width;
    if (!full) {
      text += "\x1b[J";
    } else if (fit.size() < static_cast<std::size_t>(window.height)) {
      text += "\r\n\x1b[J";
    }
    shown_ = fit;
  } else {
    for (const auto& line : lines) {
      if (std::ranges::find(shown_, line) == shown_.end()) text += line + "\n";
    }
    shown_ = lines;
  }
  write(out_, text);
}

}  // namespace scanrig::ctl
