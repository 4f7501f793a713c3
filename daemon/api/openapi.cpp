#include "daemon/api/openapi.h"

#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "core/version.h"
#include "daemon/api/json_replies.h"
#include "daemon/api/schemas.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

ordered_json schema_of(const RequestField& field) {
  ordered_json schema;
  switch (field.type) {
    case RequestField::Type::text: schema["type"] = "string"; break;
    case RequestField::Type::flag: schema["type"] = "boolean"; break;
    case RequestField::Type::number: schema["type"] = "number"; break;
    case RequestField::Type::integer: schema["type"] = "integer"; break;
  }
  if (!field.words.empty()) {
    schema["enum"] = field.words;
  } else if (field.type == RequestField::Type::text) {
    schema["minLength"] = static_cast<int>(field.min);
    schema["maxLength"] = static_cast<int>(field.max);
  } else if (field.type != RequestField::Type::flag) {
    schema["minimum"] = field.min;
    schema["maximum"] = field.max;
  }
  schema["description"] = field.description;
  return schema;
}

void add_parameters(const std::vector<RequestField>& fields, std::string_view in, ordered_json& parameters) {
  for (const auto& field : fields) {
    parameters.push_back(
        {{"name", field.name}, {"in", in}, {"required", in == "path" || field.required}, {"schema", schema_of(field)}});
  }
}

ordered_json body_of(const std::vector<RequestField>& fields) {
  ordered_json schema{{"type", "object"}, {"additionalProperties", false}, {"properties", ordered_json::object()}};
  for (const auto& field : fields) {
    schema["properties"][std::string(field.name)] = schema_of(field);
    if (field.required) schema["required"].push_back(field.name);
  }
  return {{"content", {{"application/json", {{"schema", std::move(schema)}}}}}};
}

ordered_json reference(std::string_view schema) { return {{"$ref", "#/components/schemas/" + std::string(schema)}}; }

std::string_view words_of(unsigned status) {
  switch (status) {
    case 400: return "the request cannot be understood or a value does not fit";
    case 401: return "no token, or none that is known";
    case 403: return "the role is not enough";
    case 404: return "no such thing";
    case 409: return "a rule, or the state of the rig, is against it now";
    case 413: return "the body is too large";
    case 429: return "too many requests";
    case 431: return "the header is too large";
    case 503: return "too many connections, or the daemon is too busy to answer in time";
    default: return "the disk or the daemon failed";
  }
}

ordered_json replies_of(const Route& route) {
  ordered_json replies;
  auto& good = replies[std::to_string(route.reply.status)];
  good["description"] = route.reply.description;
  const auto schema = route.reply.schema.empty() ? ordered_json{{"type", "string"}, {"format", "binary"}}
                                                 : reference(route.reply.schema);
  good["content"][std::string(route.reply.type)]["schema"] = schema;
  std::set<unsigned> errors{400, 401, 403, 413, 429, 431, 503};
  errors.insert(route.errors.begin(), route.errors.end());
  if (!route.in_path.empty()) errors.insert(404);
  for (const unsigned status : errors) {
    replies[std::to_string(status)] = {{"description", words_of(status)},
                                       {"content", {{"application/json", {{"schema", reference("Error")}}}}}};
  }
  return replies;
}

std::string lower(std::string_view text) {
  std::string low(text);
  for (auto& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return low;
}

std::string name_of(const Route& route) {
  std::string name = lower(to_string(route.method));
  for (const char c : route.path) {
    if (c != '{' && c != '}') name += c == '/' || c == '.' ? '_' : c;
  }
  return name;
}

ordered_json schemas() {
  auto all = ordered_json::parse(kSchemas);
  auto more = ordered_json::parse(kJobDetail);
  ordered_json detail = all["Job"];
  for (auto& name : more["required"]) detail["required"].push_back(std::move(name));
  detail["properties"].merge_patch(more["properties"]);
  all["JobDetail"] = std::move(detail);
  return all;
}

}  // namespace

std::string openapi_document(const std::vector<Route>& routes) {
  ordered_json document{{"openapi", "3.0.3"},
                        {"info",
                         {{"title", "scanrig"},
                          {"version", kVersion},
                          {"description",
                           "The station's API. x-role: the least role a request needs; the roles are viewer, operator, "
                           "engineer, each may what those before it may."}}},
                        {"servers", {{{"url", "/"}}}},
                        {"security", {{{"token", ordered_json::array()}}}}};
  auto& paths = document["paths"];
  for (const auto& route : routes) {
    ordered_json operation{
        {"operationId", name_of(route)}, {"summary", route.description}, {"x-role", to_string(route.role)}};
    ordered_json parameters = ordered_json::array();
    add_parameters(route.in_path, "path", parameters);
    add_parameters(route.in_query, "query", parameters);
    if (!parameters.empty()) operation["parameters"] = std::move(parameters);
    if (!route.in_body.empty()) operation["requestBody"] = body_of(route.in_body);
    operation["responses"] = replies_of(route);
    paths[std::string(route.path)][lower(to_string(route.method))] = std::move(operation);
  }
  document["components"]["schemas"] = schemas();
  document["components"]["securitySchemes"]["token"] = {{"type", "http"}, {"scheme", "bearer"}};
  return to_text(document);
}

}  // namespace scanrig
