// Parts of a camera's address.
#pragma once

#include <string>

#include "base/result.h"
#include "machine/net/endpoint.h"

namespace trammel::machine {

struct CameraUrl : HostAndPort {
  bool tls = false;
  std::string target = "/";  ///< path and query, without a fragment
  std::string user;          ///< decoded; empty where none is stated
  std::string password;

  /// Returns the URL without user and password.
  [[nodiscard]] std::string Address() const;
  /// Returns the URL for messages and recordings: also without secrets in the query, and printable.
  [[nodiscard]] std::string ToString() const;
};

/// @param text  http://[user[:password]@]host[:port][/path][?query][#fragment], or https.
/// Errors (kInput) name what is missing or wrong; control characters are refused.
[[nodiscard]] Result<CameraUrl> ParseCameraUrl(const std::string& text);

/// True if the text begins with http:// or https://, in any case of letters.
[[nodiscard]] bool IsHttpUrl(const std::string& text);

}  // namespace trammel::machine
