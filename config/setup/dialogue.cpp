#include "config/setup/dialogue.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <nlohmann/json.hpp>

namespace scanrig::config::setup {
namespace {

using nlohmann::json;
using Kind = Question::Kind;

constexpr std::array kKinds{Kind::yes_or_no, Kind::number, Kind::choice, Kind::done};

/// The whole of `text` as a number; nothing if it is none.
template <class Number>
std::optional<Number> number_in(const std::string& text) {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto [last, failed] = std::from_chars(text.data(), end, number);
  return failed == std::errc() && last == end ? std::optional(number) : std::nullopt;
}

std::optional<bool> yes_or_no(const std::string& reply) {
  if (reply == "y" || reply == "yes") return true;
  if (reply == "n" || reply == "no") return false;
  return std::nullopt;
}

std::optional<Kind> kind_of(const std::string& name) {
  for (const auto kind : kKinds) {
    if (to_string(kind) == name) return kind;
  }
  return std::nullopt;
}

}  // namespace

std::string_view to_string(Kind kind) {
  switch (kind) {
    case Kind::yes_or_no: return "yes_or_no";
    case Kind::number: return "number";
    case Kind::choice: return "choice";
    case Kind::done: break;
  }
  return "done";
}

bool Question::is_answered_by(const std::string& reply) const {
  switch (kind) {
    case Kind::yes_or_no: return yes_or_no(reply).has_value();
    case Kind::number: {
      const auto number = number_in<double>(reply);
      return number && *number >= min && *number <= max;
    }
    case Kind::choice: {
      const auto chosen = number_in<std::size_t>(reply);
      return chosen && *chosen >= 1 && *chosen <= options.size();
    }
    case Kind::done: break;
  }
  return true;
}

std::string Question::printed() const {
  switch (kind) {
    case Kind::yes_or_no: return text + " [y/n]";
    case Kind::number: return fmt::format("{} [{} to {}]", text, min, max);
    case Kind::choice: break;
    case Kind::done: return text + ", then press Enter.";
  }
  std::string lines = text;
  for (std::size_t i = 0; i < options.size(); ++i) lines += fmt::format("\n  {}  {}", i + 1, options[i]);
  return lines;
}

namespace {

/// The first reply that is valid.
Result<std::string> valid_reply(const Dialogue& dialogue, const Question& question) {
  for (;;) {
    auto reply = dialogue.prompt(question);
    if (!reply || question.is_answered_by(*reply)) return reply;
  }
}

}  // namespace

Result<void> Dialogue::wait_until_done(const std::string& what) const {
  const auto reply = prompt({.kind = Kind::done, .text = what});
  return reply ? Result<void>() : pass_on(reply);
}

Result<bool> Dialogue::prompt_yes_or_no(const std::string& question) const {
  const auto reply = valid_reply(*this, {.kind = Kind::yes_or_no, .text = question});
  if (!reply) return pass_on(reply);
  return yes_or_no(*reply).value_or(false);
}

Result<double> Dialogue::prompt_number(const std::string& question, double min, double max) const {
  const auto reply = valid_reply(*this, {.kind = Kind::number, .text = question, .min = min, .max = max});
  if (!reply) return pass_on(reply);
  return number_in<double>(*reply).value_or(min);
}

Result<std::size_t> Dialogue::choose(const std::string& question, const std::vector<std::string>& options,
                                     const std::vector<std::string>& images) const {
  if (options.size() == 1) return 0;
  const auto reply = valid_reply(*this, {.kind = Kind::choice, .text = question, .options = options, .images = images});
  if (!reply) return pass_on(reply);
  return number_in<std::size_t>(*reply).value_or(1) - 1;
}

std::string to_line(const Message& message) {
  json line;
  if (const auto& question = message.question) {
    line["ask"] = {{"kind", to_string(question->kind)},
                   {"text", question->text},
                   {"min", question->min},
                   {"max", question->max},
                   {"options", question->options},
                   {"images", question->images}};
  } else {
    line["tell"] = message.told;
  }
  return line.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::optional<Message> read_line(std::string_view line) {
  const auto read = json::parse(line, nullptr, false);
  if (!read.is_object()) return std::nullopt;
  try {
    if (read.contains("tell")) return Message{.told = read["tell"].get<std::string>()};
    const auto& ask = read.at("ask");
    const auto kind = kind_of(ask.at("kind").get<std::string>());
    if (!kind) return std::nullopt;
    return Message{.question = Question{.kind = *kind,
                                        .text = ask.at("text").get<std::string>(),
                                        .min = ask.at("min").get<double>(),
                                        .max = ask.at("max").get<double>(),
                                        .options = ask.at("options").get<std::vector<std::string>>(),
                                        .images = ask.at("images").get<std::vector<std::string>>()}};
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace scanrig::config::setup
