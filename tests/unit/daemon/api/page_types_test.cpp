// The shapes that the page reads against the OpenAPI document: a field that was renamed here would be undefined there.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "daemon/api/route.h"

namespace scanrig {
namespace {

struct PageField {
  std::string name, type;
};

/// Fields of the interfaces of web/src/api/types.ts, without those of nested objects.
std::map<std::string, std::vector<PageField>> interfaces() {
  std::ifstream file(std::string(SCANRIG_SOURCE_DIR) + "/web/src/api/types.ts");
  std::map<std::string, std::vector<PageField>> found;
  static const std::regex begin(R"(^export interface (\w+)( extends \w+)? \{$)"),
      field(R"(^  (\w+): ([^/]*[^/ ;{]);?.*$)");
  std::string line, name;
  std::smatch match;
  while (std::getline(file, line)) {
    if (std::regex_match(line, match, begin)) name = match[1];
    if (line == "}") name.clear();
    if (!name.empty() && std::regex_match(line, match, field)) found[name].push_back({match[1], match[2]});
  }
  return found;
}

/// Schema by interface, where the names differ.
const std::map<std::string, std::string> kOtherName{{"Job", "JobDetail"},
                                                    {"Snapshot", "Page"},
                                                    {"StartAction", "Action"},
                                                    {"CalibrationState", "Calibration"},
                                                    {"LogLine", "Log/lines"},
                                                    {"Recipe", "Recipes/recipes"},
                                                    {"Reference", "References/references"}};

class PageTypes : public testing::Test {
 protected:
  nlohmann::json schema_of(const std::string& interface) const {
    const auto other = kOtherName.find(interface);
    const std::string name = other == kOtherName.end() ? interface : other->second;
    const auto slash = name.find('/');
    const nlohmann::json& whole = document_["components"]["schemas"][name.substr(0, slash)];
    return slash == std::string::npos ? whole : whole["properties"][name.substr(slash + 1)]["items"];
  }

  const nlohmann::json document_ = nlohmann::json::parse(openapi_document(all_routes()));
};

std::string word_of(const nlohmann::json& schema) {
  const auto type = schema.value("type", "");
  return type == "integer" ? "number" : type;
}

TEST_F(PageTypes, EveryFieldThatThePageReadsIsSent) {
  const auto all = interfaces();
  ASSERT_GE(all.size(), 15U);
  for (const auto& [interface, fields] : all) {
    const nlohmann::json schema = schema_of(interface);
    ASSERT_TRUE(schema.is_object()) << interface << ": no schema of that name in daemon/api/openapi.cpp";
    ASSERT_FALSE(fields.empty()) << interface;
    for (const auto& field : fields) {
      const auto where = interface + "." + field.name;
      ASSERT_TRUE(schema["properties"].contains(field.name)) << where << " is in no reply";
      const nlohmann::json& sent = schema["properties"][field.name];
      static const std::regex plain("(string|number|boolean)( \\| null)?");
      std::smatch match;
      if (!std::regex_match(field.type, match, plain)) continue;
      EXPECT_EQ(word_of(sent), match[1]) << where;
      EXPECT_EQ(sent.value("nullable", false), match[2].matched) << where << ": null or not";
    }
  }
}

}  // namespace
}  // namespace scanrig
