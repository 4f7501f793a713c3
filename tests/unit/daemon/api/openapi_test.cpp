
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <set>

#include "daemon/api/route.h"

namespace scanrig {
namespace {

class OpenApi : public testing::Test {
 protected:
  const std::vector<Route> routes = all_routes();
  const nlohmann::json document = nlohmann::json::parse(openapi_document(routes));
};

TEST_F(OpenApi, HasEveryRouteWithItsRole) {
  EXPECT_EQ(document["openapi"], "3.0.3");
  std::size_t operations = 0;
  for (const auto& [path, methods] : document["paths"].items()) operations += methods.size();
  EXPECT_EQ(operations, routes.size());
  EXPECT_EQ(document["paths"]["/api/v1/start"]["post"]["x-role"], "operator");
  EXPECT_EQ(document["paths"]["/api/v1/maintenance/jog"]["post"]["x-role"], "engineer");
}

TEST_F(OpenApi, EveryOperationHasAnIdOfItsOwnAndTellsWhatItDoes) {
  std::set<std::string> ids;
  for (const auto& [path, methods] : document["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      EXPECT_TRUE(ids.insert(operation["operationId"]).second) << path;
      EXPECT_FALSE(operation["summary"].get<std::string>().empty()) << path;
      EXPECT_TRUE(operation["responses"].contains("401") && operation["responses"].contains("429")) << path;
    }
  }
}

TEST_F(OpenApi, EveryParameterOfAPathIsDescribed) {
  for (const auto& route : routes) {
    std::set<std::string_view> described;
    for (const auto& field : route.in_path) described.insert(field.name);
    for (auto at = route.path.find('{'); at != std::string_view::npos; at = route.path.find('{', at + 1)) {
      const auto name = route.path.substr(at + 1, route.path.find('}', at) - at - 1);
      EXPECT_EQ(described.erase(name), 1u) << route.path << " " << name;
    }
    EXPECT_TRUE(described.empty()) << route.path;
  }
}

TEST_F(OpenApi, EveryReferenceLeadsSomewhere) {
  const auto text = document.dump();
  for (auto at = text.find("\"$ref\":\"#"); at != std::string::npos; at = text.find("\"$ref\":\"#", at + 1)) {
    const auto begin = at + 9;
    const auto target = text.substr(begin, text.find('"', begin) - begin);
    EXPECT_TRUE(document.contains(nlohmann::json::json_pointer(target))) << target;
  }
}

TEST_F(OpenApi, ABodyIsDescribedAsItIsChecked) {
  const auto& schema =
      document["paths"]["/api/v1/maintenance/jog"]["post"]["requestBody"]["content"]["application/json"]["schema"];
  EXPECT_EQ(schema["additionalProperties"], false);
  EXPECT_EQ(schema["properties"]["by_deg"]["type"], "number");
}

}  // namespace
}  // namespace scanrig
