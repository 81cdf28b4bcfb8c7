// Address of a server and the check of its identity.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace trammel::machine {

struct HostAndPort {
  std::string host;  ///< a name or an address; an IPv6 address without its brackets
  std::uint16_t port = 0;

  /// "host:port" or "[v6]:port", as the Host header has it.
  [[nodiscard]] std::string Authority() const;
};

/// Parses "host", "host:port", "[v6]" or "[v6]:port"; without a port that of `into` is unchanged.
/// False if there is no host, a bracket is misplaced, or the port is not 1 … 65535.
[[nodiscard]] bool ParseHostAndPort(std::string_view text, HostAndPort& into);

/// Server to connect to, and its name in messages.
struct Endpoint : HostAndPort {
  bool tls = false;
  bool verify_certificate = true;
  std::filesystem::path ca_file;  ///< certificates to trust, PEM; empty: none but the system's
  bool trust_system = true;       ///< also where there is a ca_file
  double time_limit_s = 5;        ///< > 0; of look-up, connection and TLS handshake together
  std::string server = "the server";
  std::string port_hint = {};     ///< behind the advice to check the port: " (its own is 7125)"
  std::string plain = "http://";  ///< scheme if the server has no TLS
};

}  // namespace trammel::machine
