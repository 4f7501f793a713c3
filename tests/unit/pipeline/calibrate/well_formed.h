#pragma once

#include <regex>
#include <string>
#include <vector>

namespace scanrig {

/// The first tag that has no partner; empty: well-formed.
inline std::string unclosed(const std::string& page) {
  std::vector<std::string> open;
  static const std::regex kTag("<(/?)([a-z0-9]+)((?:\"[^\"]*\"|[^>\"])*?)(/?)>");
  const std::string body = page.substr(page.find('\n'));  // after the document type
  for (std::sregex_iterator tag(body.begin(), body.end(), kTag), end; tag != end; ++tag) {
    if ((*tag)[4].length() > 0) continue;
    if ((*tag)[1].length() == 0) {
      open.push_back((*tag)[2]);
    } else if (open.empty() || open.back() != (*tag)[2].str()) {
      return (*tag)[0];
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : open.back();
}

}  // namespace scanrig
