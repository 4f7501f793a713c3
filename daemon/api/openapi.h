#pragma once

#include <string>
#include <vector>

#include "daemon/api/route.h"

namespace scanrig {

/// The OpenAPI 3.0 document of these routes, as JSON.
std::string openapi_document(const std::vector<Route>& routes);

}  // namespace scanrig
