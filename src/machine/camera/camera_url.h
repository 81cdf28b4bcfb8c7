// The parts of a camera's address.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"

namespace trammel::machine {

struct CameraUrl {
  bool tls = false;
  std::string host;  ///< a name or an address; an IPv6 address without its brackets
  std::uint16_t port = 80;
  std::string target = "/";  ///< path and query, without a fragment
  std::string user;          ///< decoded; empty where none is stated
  std::string password;

  /// Without user and password.
  [[nodiscard]] std::string Address() const;
  /// For messages and recordings: also without secrets in the query, and fit to be shown.
  [[nodiscard]] std::string ToString() const;
};

/// @param text  http://[user[:password]@]host[:port][/path][?query][#fragment], or https.
/// Errors (kInput) name what is missing or wrong; control characters are refused.
[[nodiscard]] Result<CameraUrl> ParseCameraUrl(const std::string& text);

/// Whether the text begins with http:// or https://, in any case of letters.
[[nodiscard]] bool IsHttpUrl(const std::string& text);

}  // namespace trammel::machine
