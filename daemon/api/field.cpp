#include "daemon/api/field.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

namespace scanrig {
namespace {

using nlohmann::json;

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
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  if (std::ranges::any_of(text, control)) return bad(field, "has control characters");
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

Result<Values::Value> value_of(const RequestField& field, const json& value) {
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
json parse_strictly(std::string_view body) {
  std::vector<std::set<std::string>> keys;
  bool sound = true;
  const auto watch = [&](int depth, json::parse_event_t event, json& parsed) {
    using Seen = json::parse_event_t;
    sound = sound && depth <= kDeepest;
    if (event == Seen::object_start) keys.emplace_back();
    if (event == Seen::object_end && !keys.empty()) keys.pop_back();
    if (event == Seen::key && !keys.empty()) sound = keys.back().insert(parsed.get<std::string>()).second && sound;
    return sound;
  };
  auto parsed_body = json::parse(body.begin(), body.end(), watch, false);
  return sound ? parsed_body : json(json::value_t::discarded);
}

}  // namespace

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
  const auto object = blank ? json::object() : parse_strictly(body);
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
