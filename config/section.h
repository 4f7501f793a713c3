#pragma once

#include <toml++/toml.h>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"

namespace scanrig::config {

/// Collects all problems of one file, reported together and in the order of its lines.
class Problems {
 public:
  explicit Problems(std::string file) : file_(std::move(file)) {}
  void add(int line, std::string text) { found_.emplace_back(line, std::move(text)); }
  /// "FILE:LINE: text", for accepted content that should be changed.
  void warn(int line, std::string_view text) { warnings_.push_back(fmt::format("{}:{}: {}", file_, line, text)); }
  [[nodiscard]] std::size_t count() const { return found_.size(); }
  [[nodiscard]] std::vector<std::string> warnings() const { return warnings_; }
  [[nodiscard]] Error error() const;

 private:
  std::string file_;
  std::vector<std::pair<int, std::string>> found_;
  std::vector<std::string> warnings_;
};

struct Range {
  double min;
  double max;
};

template <class T>
struct Choice {
  std::string_view name;
  T value;
};

/// One table of a file. Each reader takes a required key, checks its value and stores it. A value that does not fit is
/// reported and leaves the variable unchanged. Keys that no reader takes are reported as unknown.
class Section {
 public:
  Section(const toml::table& table, std::string name, std::string prefix, Problems& problems)
      : table_(table),
        name_(std::move(name)),
        prefix_(std::move(prefix)),
        problems_(problems),
        problems_before_(problems.count()) {}

  void text(std::string_view key, std::string& value);
  void flag(std::string_view key, bool& value);
  /// A path; a relative one starts at `base`.
  void path(std::string_view key, const std::filesystem::path& base, std::filesystem::path& value);

  template <std::integral T>
  void number(std::string_view key, T& value, Range allowed) {
    if (const auto found = integer(key)) {
      if (within(key, static_cast<double>(*found), allowed)) value = static_cast<T>(*found);
    }
  }
  template <std::floating_point T>
  void number(std::string_view key, T& value, Range allowed) {
    if (const auto found = real(key)) {
      if (within(key, *found, allowed)) value = *found;
    }
  }
  /// An integer with the unit that the key's name ends with.
  template <class Rep, class Period>
  void number(std::string_view key, std::chrono::duration<Rep, Period>& value, Range allowed) {
    Rep count = value.count();
    number(key, count, allowed);
    value = std::chrono::duration<Rep, Period>(count);
  }
  template <std::integral T>
  void one_of(std::string_view key, T& value, const std::vector<T>& allowed) {
    const auto found = integer(key);
    if (!found) return;
    for (const T one : allowed) {
      if (*found == one) {
        value = one;
        return;
      }
    }
    report(key, fmt::format("{} is not one of {}", *found, fmt::join(allowed, ", ")));
  }
  /// True if it is one of them.
  template <class T>
  bool choice(std::string_view key, T& value, const std::vector<Choice<T>>& allowed) {
    std::string name;
    text(key, name);
    if (name.empty()) return false;
    std::vector<std::string_view> names;
    for (const auto& one : allowed) {
      if (one.name == name) {
        value = one.value;
        return true;
      }
      names.push_back(one.name);
    }
    report(key, fmt::format("\"{}\" is not one of {}", name, fmt::join(names, ", ")));
    return false;
  }

  /// Also accepts `old_key` for `key` from now on, its name in the version before, with a warning.
  void accept_old_name(std::string_view key, std::string_view old_key);
  /// Also accepts one old value of a text.
  void accept_old_value(std::string_view key, std::string_view value, std::string_view old_value);
  /// True if the file has an optional key; from then on the key counts as known.
  [[nodiscard]] bool has(std::string_view key);
  [[nodiscard]] bool is_table(std::string_view key) const { return table_.get(key) && table_.get(key)->is_table(); }
  void section(std::string_view key, const std::function<void(Section&)>& read);
  /// Reads each value of an array: an integer or a text.
  void items(std::string_view key, const std::function<void(std::optional<std::int64_t>, std::string_view)>& read);
  /// Keys of a table whose names are free.
  [[nodiscard]] std::vector<std::string> free_keys() const;

  /// True if this table had no problem so far: rules between its keys can be checked.
  [[nodiscard]] bool sound() const { return problems_.count() == problems_before_; }
  void report(std::string_view key, std::string_view problem);
  void warn(std::string_view key, std::string_view warning);
  void report_unknown_keys();

 private:
  const toml::node* find(std::string_view key);
  [[nodiscard]] const toml::node* get(std::string_view key) const;
  std::optional<std::int64_t> integer(std::string_view key);
  std::optional<double> real(std::string_view key);
  bool within(std::string_view key, double value, Range allowed);

  const toml::table& table_;
  std::string name_;    // name of the table in brackets
  std::string prefix_;  // prefix of the keys of an inline table: "home."
  Problems& problems_;
  std::size_t problems_before_;
  std::set<std::string, std::less<>> known_;
  std::map<std::string, std::string, std::less<>> old_names_;   // keys that the file has under their old name
  std::map<std::string, std::string, std::less<>> new_values_;  // keys whose value the file has in the old spelling
};

/// Reads the text of `file` through `read` and returns the warnings. Fails with `invalid_input` with every problem on a
/// line of its own: "FILE:LINE: [table] key: what is wrong"; a text of more than 64 KiB is one problem.
Result<std::vector<std::string>> read_toml(std::string_view text, const std::filesystem::path& file,
                                           const std::function<void(Section&)>& read);

}  // namespace scanrig::config
