#include "daemon/api/request.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

namespace scanrig {
namespace {

constexpr std::size_t kMaxLength = 2048;

int hexadecimal(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

/// Nothing for a bad escape and for forbidden characters, escaped or not.
std::optional<std::string> decode(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = hexadecimal(text[i + 1]), low = hexadecimal(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (is_control(c) || c == '\\') return std::nullopt;
    plain += c;
  }
  return plain;
}

/// No part of `segment` between its slashes is empty, "." or "..": it can be appended to a folder and stays below it.
bool stays_below(std::string_view segment) {
  for (;;) {
    const auto slash = segment.find('/');
    const auto part = segment.substr(0, slash);
    if (part.empty() || part == "." || part == "..") return false;
    if (slash == std::string_view::npos) return true;
    segment.remove_prefix(slash + 1);
  }
}

tl::unexpected<Error> bad(std::string_view problem) {
  return fail(ErrorCode::invalid_input, "the request's target {}", problem);
}

constexpr int kDeepest = 8;  ///< of a body; no route takes nested values

tl::unexpected<Error> bad(const RequestField& field, std::string_view problem) {
  return fail(ErrorCode::invalid_input, "{}: {}", field.name, problem);
}

Result<void> check_range(const RequestField& field, double value) {
  if (std::isfinite(value) && value >= field.min && value <= field.max) return {};
  return bad(field, fmt::format("must be {} to {}", field.min, field.max));
}

Result<Values::Value> check_text(const RequestField& field, const std::string& text) {
  if (!field.words.empty() && std::ranges::find(field.words, text) == field.words.end()) {
    return bad(field, fmt::format("is not one of {}", fmt::join(field.words, ", ")));
  }
  const auto size = static_cast<double>(text.size());
  if (field.words.empty() && (size < field.min || size > field.max)) {
    return bad(field, fmt::format("must have {} to {} bytes", field.min, field.max));
  }
  if (std::ranges::any_of(text, is_control)) return bad(field, "has control characters");
  return text;
}

template <class Number>
Result<Values::Value> parse_number(const RequestField& field, const std::string& text, std::string_view kind) {
  Number value{};
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) return bad(field, kind);
  if (auto fits = check_range(field, static_cast<double>(value)); !fits) return pass_on(fits);
  return value;
}

constexpr std::string_view kNoNumber = "is not a number", kNoInteger = "is not a whole number",
                           kNoFlag = "is not true or false", kNoText = "is not a text";

Result<Values::Value> value_of(const RequestField& field, const nlohmann::json& value) {
  switch (field.type) {
    case RequestField::Type::text:
      return value.is_string() ? check_text(field, value.get<std::string>()) : bad(field, kNoText);
    case RequestField::Type::flag:
      return value.is_boolean() ? Result<Values::Value>(value.get<bool>()) : bad(field, kNoFlag);
    case RequestField::Type::number: {
      if (!value.is_number()) return bad(field, kNoNumber);
      if (auto fits = check_range(field, value.get<double>()); !fits) return pass_on(fits);
      return value.get<double>();
    }
    case RequestField::Type::integer: break;
  }
  if (!value.is_number_integer()) return bad(field, kNoInteger);
  if (auto fits = check_range(field, value.get<double>()); !fits) return pass_on(fits);
  return value.get<std::int64_t>();
}

/// nlohmann's parser keeps the last of two equal keys; here that is reported as an error, as is too deep a nesting.
nlohmann::json parse_strictly(std::string_view body) {
  std::vector<std::set<std::string>> keys;
  bool sound = true;
  const auto watch = [&](int depth, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
    using Seen = nlohmann::json::parse_event_t;
    sound = sound && depth <= kDeepest;
    if (event == Seen::object_start) keys.emplace_back();
    if (event == Seen::object_end && !keys.empty()) keys.pop_back();
    if (event == Seen::key && !keys.empty()) sound = keys.back().insert(parsed.get<std::string>()).second && sound;
    return sound;
  };
  auto parsed_body = nlohmann::json::parse(body.begin(), body.end(), watch, false);
  return sound ? parsed_body : nlohmann::json(nlohmann::json::value_t::discarded);
}

}  // namespace

Result<RequestTarget> parse_target(std::string_view target) {
  if (target.size() > kMaxLength) return bad("is too long");
  if (!target.starts_with('/')) return bad("does not begin with a slash");
  RequestTarget parsed;
  const auto mark = target.find('?');
  auto path = target.substr(1, mark == std::string_view::npos ? mark : mark - 1);
  for (bool more = !path.empty(); more;) {
    const auto slash = path.find('/');
    auto segment = decode(path.substr(0, slash));
    if (!segment || !stays_below(*segment)) return bad("has a segment that is not a name");
    parsed.segments.push_back(std::move(*segment));
    more = slash != std::string_view::npos;
    path.remove_prefix(more ? slash + 1 : path.size());
  }
  auto query = mark == std::string_view::npos ? std::string_view() : target.substr(mark + 1);
  while (!query.empty()) {
    const auto end = query.find('&');
    const auto item = query.substr(0, end);
    const auto equals = item.find('=');
    const auto key = decode(item.substr(0, equals));
    const auto value = decode(equals == std::string_view::npos ? std::string_view() : item.substr(equals + 1));
    if (!key || !value || key->empty()) return bad("has a query that cannot be understood");
    if (std::ranges::find(parsed.query, *key, &std::pair<std::string, std::string>::first) != parsed.query.end()) {
      return bad("has a key twice");
    }
    parsed.query.emplace_back(*key, *value);
    query = end == std::string_view::npos ? std::string_view() : query.substr(end + 1);
  }
  return parsed;
}

Result<Values::Value> parse_value(const RequestField& field, const std::string& text) {
  switch (field.type) {
    case RequestField::Type::text: return check_text(field, text);
    case RequestField::Type::number: return parse_number<double>(field, text, kNoNumber);
    case RequestField::Type::integer: return parse_number<std::int64_t>(field, text, kNoInteger);
    case RequestField::Type::flag: break;
  }
  if (text != "true" && text != "false") return bad(field, kNoFlag);
  return text == "true";
}

Result<void> read_body(std::string_view body, const std::vector<RequestField>& fields, Values& values) {
  const auto blank = body.find_first_not_of(" \t\r\n") == std::string_view::npos;
  const auto object = blank ? nlohmann::json::object() : parse_strictly(body);
  if (!object.is_object()) {
    return fail(ErrorCode::invalid_input, "the body is not a JSON object with every key once");
  }
  for (const auto& [key, value] : object.items()) {
    const auto field = std::ranges::find(fields, key, &RequestField::name);
    if (field == fields.end()) {
      std::vector<std::string_view> known;
      std::ranges::transform(fields, std::back_inserter(known), &RequestField::name);
      return fail(ErrorCode::invalid_input, "the body has an unknown key; known here: {}", fmt::join(known, ", "));
    }
    auto read = value_of(*field, value);
    if (!read) return pass_on(read);
    values.set(key, std::move(*read));
  }
  for (const auto& field : fields) {
    if (field.required && !object.contains(field.name)) return bad(field, "is missing");
  }
  return {};
}

}  // namespace scanrig
