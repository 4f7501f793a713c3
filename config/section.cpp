#include "config/section.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace scanrig::config {
namespace {

constexpr std::size_t kMaxProblems = 20;
/// Every dot of a key opens a table in a table, and toml++ destroys those by recursion: 100 000 levels are too many for
/// a stack of 8 MiB.
constexpr std::size_t kMaxBytes = 64 * 1024;

int line_of(const toml::node& node) { return std::max(1, static_cast<int>(node.source().begin.line)); }

}  // namespace

Error Problems::error() const {
  auto sorted = found_;
  std::ranges::stable_sort(sorted, {}, &std::pair<int, std::string>::first);
  std::string message;
  for (std::size_t i = 0; i < std::min(sorted.size(), kMaxProblems); ++i) {
    message += fmt::format("{}{}:{}: {}", i == 0 ? "" : "\n", file_, sorted[i].first, sorted[i].second);
  }
  if (sorted.size() > kMaxProblems) message += fmt::format("\nand {} more", sorted.size() - kMaxProblems);
  return {ErrorCode::invalid_input, message};
}

const toml::node* Section::find(std::string_view key) {
  known_.emplace(key);
  const toml::node* node = get(key);
  if (!node) problems_.add(line_of(table_), fmt::format("{}{}{}: missing", name_, prefix_, key));
  return node;
}

const toml::node* Section::get(std::string_view key) const {
  const auto old_name = old_names_.find(key);
  return table_.get(old_name == old_names_.end() ? key : std::string_view(old_name->second));
}

void Section::accept_old_name(std::string_view key, std::string_view old_key) {
  if (!table_.contains(old_key) || table_.contains(key)) return;  // with both, the old key is reported as unknown
  known_.emplace(old_key);
  old_names_.emplace(key, old_key);
  warn(old_key, fmt::format("this key is called {} now; the next version refuses the old name", key));
}

void Section::accept_old_value(std::string_view key, std::string_view value, std::string_view old_value) {
  const toml::node* node = get(key);
  if (!node || node->value<std::string_view>() != old_value) return;
  new_values_.emplace(key, value);
  warn(key, fmt::format("\"{}\" is called \"{}\" now; the next version refuses the old name", old_value, value));
}

void Section::report(std::string_view key, std::string_view problem) {
  const toml::node* node = get(key);
  problems_.add(line_of(node ? *node : table_), fmt::format("{}{}{}: {}", name_, prefix_, key, problem));
}

void Section::warn(std::string_view key, std::string_view warning) {
  const toml::node* node = get(key);
  problems_.warn(line_of(node ? *node : table_), fmt::format("{}{}{}: {}", name_, prefix_, key, warning));
}

void Section::text(std::string_view key, std::string& value) {
  const toml::node* node = find(key);
  if (!node) return;
  const auto* found = node->as_string();
  if (!found) return report(key, "must be a text in quotes");
  if (found->get().empty()) return report(key, "must not be empty");
  const auto new_value = new_values_.find(key);
  value = new_value == new_values_.end() ? found->get() : new_value->second;
}

void Section::flag(std::string_view key, bool& value) {
  const toml::node* node = find(key);
  if (!node) return;
  if (const auto* found = node->as_boolean()) {
    value = found->get();
  } else {
    report(key, "must be true or false");
  }
}

void Section::path(std::string_view key, const std::filesystem::path& base, std::filesystem::path& value) {
  std::string found;
  text(key, found);
  if (found.find('\0') != std::string::npos) return report(key, "is not a path");
  value = base / found;
}

std::optional<std::int64_t> Section::integer(std::string_view key) {
  const toml::node* node = find(key);
  if (!node) return std::nullopt;
  if (const auto* found = node->as_integer()) return found->get();
  report(key, "must be a whole number");
  return std::nullopt;
}

std::optional<double> Section::real(std::string_view key) {
  const toml::node* node = find(key);
  if (!node) return std::nullopt;
  if (const auto* found = node->as_floating_point()) return found->get();
  if (const auto* found = node->as_integer()) return static_cast<double>(found->get());
  report(key, "must be a number");
  return std::nullopt;
}

bool Section::within(std::string_view key, double value, Range allowed) {
  if (value >= allowed.min && value <= allowed.max) return true;  // false for NaN
  report(key, fmt::format("{} is not between {} and {}", value, allowed.min, allowed.max));
  return false;
}

bool Section::has(std::string_view key) {
  known_.emplace(key);
  return get(key) != nullptr;
}

void Section::section(std::string_view key, const std::function<void(Section&)>& read) {
  const toml::node* node = find(key);
  if (!node) return;
  const toml::table* table = node->as_table();
  if (!table) return report(key, "must be a table");
  const bool in_brackets = name_.empty() || !table->is_inline();
  const std::string path =
      name_.empty() ? std::string(key) : name_.substr(1, name_.size() - 3) + "." + std::string(key);
  Section inner(*table, in_brackets ? "[" + path + "] " : name_, in_brackets ? "" : prefix_ + std::string(key) + ".",
                problems_);
  read(inner);
  inner.report_unknown_keys();
}

void Section::items(std::string_view key,
                    const std::function<void(std::optional<std::int64_t>, std::string_view)>& read) {
  const toml::node* node = find(key);
  if (!node) return;
  const toml::array* array = node->as_array();
  if (!array) return report(key, "must be a list in square brackets");
  for (const toml::node& item : *array) {
    if (const auto* text = item.as_string()) {
      read(std::nullopt, text->get());
    } else if (const auto* number = item.as_integer()) {
      read(number->get(), "");
    } else {
      report(key, "may contain whole numbers and texts only");
    }
  }
}

std::vector<std::string> Section::free_keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, node] : table_) keys.emplace_back(key.str());
  return keys;
}

void Section::report_unknown_keys() {
  for (const auto& [key, node] : table_) {
    if (known_.contains(key.str())) continue;
    problems_.add(
        std::max(1, static_cast<int>(key.source().begin.line)),
        fmt::format("{}{}{}: unknown key; known here: {}", name_, prefix_, key.str(), fmt::join(known_, ", ")));
  }
}

Result<std::vector<std::string>> read_toml(std::string_view text, const std::filesystem::path& file,
                                           const std::function<void(Section&)>& read) {
  Problems problems(file.string());
  if (text.size() > kMaxBytes) {
    problems.add(1, fmt::format("{} bytes are too many; a file of this kind has at most {}", text.size(), kMaxBytes));
    return tl::unexpected(problems.error());
  }
  try {
    const toml::table table = toml::parse(text, file.string());
    Section root(table, "", "", problems);
    read(root);
    root.report_unknown_keys();
  } catch (const toml::parse_error& error) {
    problems.add(static_cast<int>(error.source().begin.line), std::string(error.description()));
  }
  if (problems.count() > 0) return tl::unexpected(problems.error());
  return problems.warnings();
}

}  // namespace scanrig::config
