#include "config/setup/dialogue.h"

#include <fmt/format.h>

#include <charconv>

namespace scanrig::config::setup {

Result<bool> Dialogue::prompt_yes_or_no(const std::string& question) const {
  for (;;) {
    const auto reply = prompt(question + " [y/n]");
    if (!reply) return pass_on(reply);
    if (*reply == "y" || *reply == "yes") return true;
    if (*reply == "n" || *reply == "no") return false;
  }
}

Result<double> Dialogue::prompt_number(const std::string& question, double min, double max) const {
  for (;;) {
    const auto reply = prompt(fmt::format("{} [{} to {}]", question, min, max));
    if (!reply) return pass_on(reply);
    double number = 0;
    const char* const end = reply->data() + reply->size();
    const auto [last, failed] = std::from_chars(reply->data(), end, number);
    if (failed == std::errc() && last == end && number >= min && number <= max) return number;
  }
}

Result<std::size_t> Dialogue::choose(const std::string& question, const std::vector<std::string>& options) const {
  if (options.size() == 1) return 0;
  std::string text = question;
  for (std::size_t i = 0; i < options.size(); ++i) text += fmt::format("\n  {}  {}", i + 1, options[i]);
  const auto number = [&](const std::string& reply) {
    std::size_t n = 0;
    const char* const end = reply.data() + reply.size();
    const auto [last, failed] = std::from_chars(reply.data(), end, n);
    return failed == std::errc() && last == end ? n : 0;
  };
  for (;;) {
    const auto reply = prompt(text);
    if (!reply) return pass_on(reply);
    if (const auto n = number(*reply); n >= 1 && n <= options.size()) return n - 1;
  }
}

}  // namespace scanrig::config::setup
