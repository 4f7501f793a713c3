#pragma once

#include <string_view>

namespace scanrig::web {

/// One file of the page, as it is part of the program.
struct EmbeddedFile {
  std::string_view path;  ///< "assets/main-1a2b3c4d.js"
  std::string_view type;  ///< "text/javascript"
  std::string_view gzip;  ///< its compressed bytes
};

/// Null where the page has no file of that name, or the build no page. Threads: any.
const EmbeddedFile* find_embedded_file(std::string_view path);

/// Differs between builds whose pages differ; empty: this build has no page.
std::string_view embedded_build();

}  // namespace scanrig::web
