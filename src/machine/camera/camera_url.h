// The parts of a camera's address.
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
