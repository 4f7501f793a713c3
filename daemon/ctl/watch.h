#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace scanrig::ctl {
/// Part of some lines that fits a terminal of `width` x `height`.
struct Window {
  int width = 80, height = 24;
};
/// Lines wrapped to the window; if there are too many, the last one gives the number missing. Widths count code
/// points.
std::vector<std::string> fitted(const std::vector<std::string>& lines, Window window);

/// Text kept up to date. On a terminal one screen, written as a whole only on changes, with nothing
/// erased first: no flicker. Elsewhere (a pipe, TERM=dumb) the lines that changed. Leaves the terminal as it was.
class Screen {
 public:
  explicit Screen(std::FILE* out);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void show(const std::vector<std::string>& lines);

 private:
  std::FILE* out_;
  bool terminal_;
  std::vector<std::string> shown_;
};

/// The lines of `scanrig status --watch`. `status`, `health`: as the API gives them; `job`: the active one
/// or the last active one, null: none.
std::vector<std::string> watch_lines(const nlohmann::json& status, const nlohmann::json& health,
                                     const nlohmann::json& job);

}  // namespace scanrig::ctl
