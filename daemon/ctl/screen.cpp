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

std::string cut(const std::string& line, int width) {
  int points = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (!is_continuation(line[i]) && ++points > width) return line.substr(0, i);
  }
  return line;
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
  std::vector<std::string> fit;
  const auto room = static_cast<std::size_t>(std::max(window.height, 1));
  for (const auto& line : lines) {
    if (fit.size() + 1 == room && lines.size() > room) {
      fit.push_back(cut(fmt::format("({} more lines)", lines.size() - fit.size()), window.width));
      break;
    }
    fit.push_back(cut(line, window.width));
  }
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
    const auto fit = fitted(lines, window_of(out_));
    if (fit == shown_) return;
    for (std::size_t i = 0; i < fit.size(); ++i) text += (i == 0 ? "\x1b[H" : "\r\n") + fit[i] + "\x1b[K";
    text += "\x1b[J";
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
