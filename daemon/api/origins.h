#pragma once

#include <string>
#include <string_view>

namespace scanrig {

/// Names of this server, as clients may call it. A page of another site that has its own name point here (DNS
/// rebinding) sends that name, and is refused.
class OwnOrigins {
 public:
  /// `http_origin`: "https://rig.example", how browsers reach the server through a proxy; empty: directly.
  explicit OwnOrigins(std::string http_origin);

  /// Value of the header Host: an address, localhost, this machine's name, a name ending in .local, or that of
  /// `http_origin`; any port.
  [[nodiscard]] bool is_own_host(std::string_view host) const;
  /// Value of the header Origin of a page that was served under `host`.
  [[nodiscard]] bool is_own_origin(std::string_view origin, std::string_view host) const;

 private:
  std::string http_origin_, machine_;
};

/// The value of one cookie; empty where the header does not hold it.
std::string_view cookie_value(std::string_view header, std::string_view name);

/// Name of the cookie that a login sets: over https one that browsers accept from this host alone.
constexpr std::string_view login_cookie(bool tls) { return tls ? "__Host-scanrig" : "scanrig"; }

}  // namespace scanrig
