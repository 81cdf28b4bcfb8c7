// Decides which requests a panel accepts: none that another web page makes in its owner's browser.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::panel {

struct GuardOptions {
  /// Names under which browsers may open the panel, besides addresses in numbers, localhost and
  /// this computer's own name.
  std::vector<std::string> names = {};
};

/// Head of a request, as far as it decides.
struct RequestHead {
  std::string_view method;
  std::string_view host;          ///< field Host
  std::string_view origin;        ///< field Origin; empty: none
  std::string_view fetch_site;    ///< field Sec-Fetch-Site; empty: none
  std::string_view content_type;  ///< without parameters
  bool upgrades = false;          ///< to a WebSocket
};

struct Denial {
  unsigned status = 403;
  std::string message;  ///< names the remedy
};

/// Checks a request: its Host against rebinding of names, and, where it changes something or opens
/// a WebSocket, that a page of the panel's own made it, or no browser. Content types that a form
/// can send are refused, so that a browser asks before it sends any other across origins.
[[nodiscard]] std::optional<Denial> CheckRequest(const RequestHead& head,
                                                 const GuardOptions& options);

/// True for loopback, private and link-local addresses, and those that map them (IPv4 in IPv6).
[[nodiscard]] bool IsNearby(std::string_view address);

/// Returns the name or number in a Host field, without its port and brackets; empty if it is none.
[[nodiscard]] std::string HostName(std::string_view host);

/// Returns the policy for pages: nothing of other hosts, no inline script or style, frames of the
/// same host only. @param host  HostName's, checked
[[nodiscard]] std::string ContentSecurityPolicy(std::string_view host);

}  // namespace trammel::panel
