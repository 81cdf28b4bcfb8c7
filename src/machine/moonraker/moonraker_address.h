// Where a Moonraker listens, taken apart.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::machine {

enum class Transport { kTcp, kTls, kUnix };

struct MoonrakerAddress {
  Transport transport = Transport::kTcp;
  std::string host;                     ///< without brackets; empty for a Unix socket
  std::string port;                     ///< "1" … "65535"
  std::string endpoint = "/websocket";  ///< of the WebSocket, below the prefix
  std::string path_prefix;  ///< what stands before /websocket and /server, for example "/voron"
  std::string unix_path;    ///< only with kUnix

  /// As people write it, for messages: "ws://host:7125/websocket", "unix:/run/moonraker.sock".
  [[nodiscard]] std::string WebSocketUrl() const;
  /// "http://host:7125" and the prefix; REQUIRES a transport other than kUnix.
  [[nodiscard]] std::string HttpUrl() const;
  /// host:port as the Host header has it.
  [[nodiscard]] std::string Authority() const;
};

/// Understands what MoonrakerOptions::address lists. Without a scheme the port is 7125; with one it
/// is the scheme's own, 80 or 443. Fails with kInput and shows the forms that are understood.
[[nodiscard]] Result<MoonrakerAddress> ParseMoonrakerAddress(std::string_view text);

}  // namespace trammel::machine
