// Address of a printer's Moonraker and its credentials.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/net/endpoint.h"

namespace trammel::machine {

/// Validated by ParseMoonrakerAddress when connecting; an invalid field fails with kInput.
struct MoonrakerOptions {
  /// "voron.local", "192.168.1.20:7125", "http://…", "https://…", "ws://…/websocket", "wss://…",
  /// or "unix:/home/pi/printer_data/comms/moonraker.sock". Where not given: port 7125 without a
  /// scheme, 80 with http and ws, 443 with TLS; path /websocket.
  std::string address = "localhost";
  /// Upload address if `address` is a Unix socket, which takes no files.
  std::string http_address = "http://localhost:7125";
  std::string api_key = {};  ///< empty: none. Sent as X-Api-Key and in identify.
  std::string ca_file = {};  ///< PEM; empty: the system's authorities
  bool accept_any_certificate =
      false;  ///< accepts self-signed ones; anyone could then pose as the printer
  std::string client_name = "trammel";  ///< shown to other clients; one agent per name
  std::string client_version = "0.1";   ///< likewise
  /// If another agent has the name, uses name-2 … name-9. Otherwise the connection fails and is
  /// retried like any that is lost: for an agent that others call by its name.
  bool other_names = true;
  bool quote_messages = false;       ///< errors end with the last messages of the conversation
  double connect_time_limit_s = 10;  ///< per attempt, 0.1 … 600
};

/// Maximum size of an incoming message (a long configuration has 1 MB), and of waiting outgoing
/// ones together.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{16} << 20;

enum class Transport { kTcp, kTls, kUnix };

struct MoonrakerAddress : HostAndPort {  // host is empty for a Unix socket
  Transport transport = Transport::kTcp;
  std::string endpoint = "/websocket";  ///< WebSocket path below the prefix
  std::string path_prefix;              ///< prefix of /websocket and /server, for example "/voron"
  std::string unix_path;                ///< only with kUnix

  /// Returns the URL for messages: "ws://host:7125/websocket", "unix:/run/moonraker.sock".
  [[nodiscard]] std::string WebSocketUrl() const;
  /// "http://host:7125" and the prefix; REQUIRES a transport other than kUnix.
  [[nodiscard]] std::string HttpUrl() const;
};

/// Parses the forms listed at MoonrakerOptions::address. Without a scheme the port is 7125; with
/// one it is the scheme's own, 80 or 443. Fails with kInput and shows the accepted forms.
[[nodiscard]] Result<MoonrakerAddress> ParseMoonrakerAddress(std::string_view text);

/// Returns the server of an address that is no Unix socket's.
[[nodiscard]] Endpoint EndpointOf(const MoonrakerAddress& address, const MoonrakerOptions& options);

/// Explains an unexpected HTTP answer, and the remedy.
/// @param server  its Server header, may be empty
[[nodiscard]] std::string HttpRefusal(int status, std::string_view server,
                                      const MoonrakerAddress& address, bool had_key);

}  // namespace trammel::machine
