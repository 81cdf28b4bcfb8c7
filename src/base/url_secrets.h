// Removes secrets from addresses, so that they may be shown and stored.
#pragma once

#include <string>
#include <string_view>

namespace trammel {

/// Returns the address with user and password (http://user:password@host, also without its scheme)
/// and the values of secret query fields (token, key, password, …) replaced by an ellipsis. If the
/// end of a password is ambiguous, removes more. Accepts any text.
[[nodiscard]] std::string WithoutSecrets(std::string_view address);

}  // namespace trammel
