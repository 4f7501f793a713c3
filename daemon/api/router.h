#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/route.h"

namespace scanrig {

/// Every route of the API, in the order of the OpenAPI document.
std::vector<Route> all_routes();

/// Finds the route of a request and checks all its values.
class Router {
 public:
  explicit Router(std::vector<Route> routes = all_routes());

  /// A request whose path, method, role and parameters are right.
  struct Match {
    const Route* route = nullptr;
    Values values{};
  };
  /// The match, or the error reply: 400, 401 (`role` is nothing), 403, 404, 405.
  [[nodiscard]] tl::expected<Match, ApiResponse> find(std::string_view method, std::string_view target,
                                                      std::optional<Role> role) const;
  /// Reads the body and runs the route; `send` as in Route. 400 for a body that does not fit.
  static void call(Match match, std::string_view body, const ApiStation& station, Send send);

  [[nodiscard]] const std::vector<Route>& routes() const { return routes_; }

 private:
  std::vector<Route> routes_;
  std::vector<std::vector<std::string_view>> paths_;  // of each route, in segments
};

}  // namespace scanrig
