// Addresses as they may be shown and kept: without what opens doors.
#pragma once

#include <string>
#include <string_view>

namespace trammel {

/// The address with user and password (http://user:password@host, also without its scheme) and the
/// values of query fields whose names speak of secrets (token, key, password, …) replaced by an
/// ellipsis. In doubt where a password ends, more is left out. Takes any text.
[[nodiscard]] std::string WithoutSecrets(std::string_view address);

}  // namespace trammel
