#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/result.h"
#include "daemon/api/roles.h"

namespace scanrig {

/// The parts of a request target: "/api/v1/jobs/a%20b?limit=5" has segments api, v1, jobs, "a b" and a query.
struct RequestTarget {
  std::vector<std::string> segments;                       ///< decoded, none empty, none "." or ".."
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in order
};

/// Fails with `invalid_input`: no leading slash, an invalid escape, a NUL or control character, an empty or dot
/// segment (also behind an escaped slash), a key twice, over 2048 bytes.
Result<RequestTarget> parse_target(std::string_view target);

/// One value that a request may carry: in its path, in its query, or in its JSON body. The same description
/// checks requests and is printed in the OpenAPI document.
struct RequestField {
  enum class Type { text, number, integer, flag };
  std::string_view name;
  Type type = Type::text;
  std::string_view description;
  bool required = false;
  double min = 0.0, max = 0.0;            ///< of a number; of the length of a text, in bytes
  std::vector<std::string_view> words{};  ///< a text must be one of these; empty: any
};

/// Values of a request, checked against its fields; all their names in one list.
class Values {
 public:
  using Value = std::variant<std::string, double, std::int64_t, bool>;
  void set(std::string_view name, Value value) { values_.insert_or_assign(std::string(name), std::move(value)); }
  [[nodiscard]] bool has(std::string_view name) const { return values_.contains(name); }
  /// A value of the field's type; nothing when the request does not carry it.
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const { return get<std::string>(name); }
  [[nodiscard]] std::optional<double> number(std::string_view name) const { return get<double>(name); }
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view name) const { return get<std::int64_t>(name); }
  [[nodiscard]] bool flag(std::string_view name) const { return get<bool>(name).value_or(false); }
  /// The user of this machine or the address that sent the request, as the log names it.
  [[nodiscard]] const std::string& requester() const { return requester_; }
  [[nodiscard]] const Identity& identity() const { return identity_; }
  /// The same for others to read: the name of the token where there is one.
  [[nodiscard]] const std::string& sender() const { return identity_.token.empty() ? requester_ : identity_.token; }
  void set_requester(std::string requester, Identity identity) {
    requester_ = std::move(requester);
    identity_ = std::move(identity);
  }

 private:
  template <class T>
  std::optional<T> get(std::string_view name) const {
    const auto found = values_.find(name);
    if (found == values_.end() || !std::holds_alternative<T>(found->second)) return std::nullopt;
    return std::get<T>(found->second);
  }
  std::map<std::string, Value, std::less<>> values_;
  std::string requester_;
  Identity identity_;
};

/// Reads the text of a parameter as `field` describes it. Fails with `invalid_input`, naming the field.
Result<Values::Value> parse_value(const RequestField& field, const std::string& text);

/// Reads a JSON body into `values`: an object of known keys, each as its field describes. An empty body is an empty
/// object. Fails with `invalid_input`.
Result<void> read_body(std::string_view body, const std::vector<RequestField>& fields, Values& values);

}  // namespace scanrig
