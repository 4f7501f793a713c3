#pragma once

#include <string>
#include <string_view>

namespace scanrig {

/// `text` with API tokens and the addresses of URLs, which may carry credentials, replaced by "(removed)".
std::string without_secrets(std::string_view text);

}  // namespace scanrig
