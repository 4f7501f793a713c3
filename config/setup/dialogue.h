#pragma once

#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig::config::setup {

/// Questions to the person at the rig. Every question is repeated until its reply is valid.
class Dialogue {
 public:
  virtual ~Dialogue() = default;
  virtual void tell(const std::string& text) const = 0;
  /// One line. Fails with `refused` when the replies end.
  [[nodiscard]] virtual Result<std::string> prompt(const std::string& question) const = 0;

  // Fail as prompt().
  [[nodiscard]] Result<bool> prompt_yes_or_no(const std::string& question) const;
  [[nodiscard]] Result<double> prompt_number(const std::string& question, double min, double max) const;
  /// Index of the chosen one, told by its number from 1. Not asked where there is one only.
  [[nodiscard]] Result<std::size_t> choose(const std::string& question, const std::vector<std::string>& options) const;
};

}  // namespace scanrig::config::setup
