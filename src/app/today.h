// The date where the computer stands.
#pragma once

#include <string>

namespace trammel::app {

/// YYYY-MM-DD in the computer's own time zone, as people write dates into files.
[[nodiscard]] std::string Today();

}  // namespace trammel::app
