#pragma once

#include <string>
#include <vector>

#include "daemon/api/route.h"

namespace scanrig {

/// The OpenAPI 3.0 document of these routes, as JSON.
std::string openapi_document(const std::vector<Route>& routes);

/// The shapes of the API's replies: a JSON object of OpenAPI 3.0 schemas by name.
extern const char* const kSchemas;
/// Additions that make the schema Job into JobDetail: a JSON merge patch (RFC 7396), but its `required` is added.
extern const char* const kJobDetail;

}  // namespace scanrig
