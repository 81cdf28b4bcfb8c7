// The date where the computer stands.
#pragma once

#include <string>

namespace trammel::app {

/// YYYY-MM-DD, of UTC.
[[nodiscard]] std::string Today();

}  // namespace trammel::app
