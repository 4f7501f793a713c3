#pragma once

namespace scanrig {

/// The shapes of the API's replies: a JSON object of OpenAPI 3.0 schemas by name.
extern const char* const kSchemas;

}  // namespace scanrig
