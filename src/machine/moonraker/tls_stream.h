// TLS for the printer's server, the same for WebSocket and HTTP.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <string>

#include "base/result.h"
#include "machine/moonraker/moonraker_address.h"
#include "machine/moonraker/moonraker_options.h"

namespace trammel::machine {

/// A context that verifies the server by options.ca_file or the system's authorities, unless
/// options.accept_any_certificate. Fails with kInput where the file cannot be used.
[[nodiscard]] Result<boost::asio::ssl::context> MakeTlsContext(const MoonrakerOptions& options);

/// Sets the name that the server is asked for and that its certificate must carry.
[[nodiscard]] Result<void> ExpectHost(SSL* ssl, const MoonrakerAddress& address,
                                      const MoonrakerOptions& options);

/// Why a TLS handshake failed and what to do, from the connection's state after it.
[[nodiscard]] std::string TlsFailure(SSL* ssl, const MoonrakerAddress& address,
                                     const std::string& what);

}  // namespace trammel::machine
