// Whom a server on this computer answers: not a page of somewhere else in a browser that runs here.
#pragma once

#include <string_view>

namespace trammel::sim {

/// Whether a request's Host names this computer (by a number, or as localhost): a name that was
/// made to point here does not. An empty one is of no browser.
[[nodiscard]] bool IsOwnHost(std::string_view host);

/// Whether a request's Origin is a page of this computer's. An empty one is of no page.
[[nodiscard]] bool IsOwnOrigin(std::string_view origin);

}  // namespace trammel::sim
