#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace scanrig::json_schema {

using nlohmann::json;

inline bool has_type(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  return type == "boolean" && value.is_boolean();
}

/// Checks `value` against an OpenAPI 3.0 schema, as much of it as the API's document uses. `document`: for references.
inline testing::AssertionResult fits(const json& value, const json& schema, const json& document,
                                     const std::string& where = "$") {
  const auto no = [&](const std::string& why) { return testing::AssertionFailure() << where << ": " << why; };
  if (schema.contains("$ref")) {
    const auto target = json::json_pointer(schema["$ref"].get<std::string>().substr(1));
    if (!document.contains(target)) return no("no " + schema["$ref"].dump());
    return fits(value, document[target], document, where);
  }
  if (value.is_null() && schema.value("nullable", false)) return testing::AssertionSuccess();
  for (const auto& part : schema.value("allOf", json::array())) {
    if (auto one = fits(value, part, document, where); !one) return one;
  }
  if (schema.contains("type") && !has_type(value, schema["type"]))
    return no(value.dump() + " is no " + schema["type"].dump());
  if (schema.contains("minimum") && value < schema["minimum"]) return no("too small");
  if (schema.contains("maximum") && value > schema["maximum"]) return no("too large");
  for (const auto& key : schema.value("required", json::array())) {
    if (!value.contains(key.get<std::string>())) return no("lacks " + key.dump());
  }
  if (value.is_array() && schema.contains("items")) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (auto one = fits(value[i], schema["items"], document, where + "[" + std::to_string(i) + "]"); !one) return one;
    }
  }
  if (!value.is_object()) return testing::AssertionSuccess();
  const auto properties = schema.value("properties", json::object());
  const auto rest = schema.value("additionalProperties", json(true));
  for (const auto& [key, member] : value.items()) {
    const auto path = fmt::format("{}.{}", where, key);
    if (!properties.contains(key) && rest == false) return no("has an unknown key " + key);
    if (!properties.contains(key) && !rest.is_object()) continue;
    if (auto one = fits(member, properties.contains(key) ? properties[key] : rest, document, path); !one) return one;
  }
  return testing::AssertionSuccess();
}

}  // namespace scanrig::json_schema
