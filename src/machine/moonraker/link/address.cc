#include "machine/moonraker/link/address.h"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>

#include "base/check.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kMaxAddress = 2048;  // longer ones are no address

tl::unexpected<Error> BadAddress(std::string_view text, std::string_view why) {
  return Fail(
      fmt::format("cannot use '{}' as the printer's address: {}; write it like voron.local, "
                  "192.168.1.20:7125, https://printer.example/websocket or "
                  "unix:/home/pi/printer_data/comms/moonraker.sock",
                  text.substr(0, 200), why));
}

bool IsPlain(char c) { return c > ' ' && c < 0x7F && c != '"' && c != '\\' && c != '@'; }

Result<MoonrakerAddress> ParseUnix(std::string_view text, std::string_view path) {
  while (path.starts_with("//")) path.remove_prefix(1);
  if (path.size() < 2 || path.front() != '/') {
    return BadAddress(text, "a Unix socket needs an absolute path");
  }
  if (path.size() >= sizeof(sockaddr_un::sun_path)) {
    return BadAddress(text, fmt::format("its path has {} bytes, {} are possible", path.size(),
                                        sizeof(sockaddr_un::sun_path) - 1));
  }
  MoonrakerAddress address;
  address.transport = Transport::kUnix;
  address.unix_path = path;
  return address;
}

}  // namespace

std::string MoonrakerAddress::WebSocketUrl() const {
  if (transport == Transport::kUnix) return "unix:" + unix_path;
  return fmt::format("{}://{}{}{}", transport == Transport::kTls ? "wss" : "ws", Authority(),
                     path_prefix, endpoint);
}

std::string MoonrakerAddress::HttpUrl() const {
  TRAMMEL_CHECK(transport != Transport::kUnix, "a Unix socket has no URL: {}", unix_path);
  return fmt::format("{}://{}{}", transport == Transport::kTls ? "https" : "http", Authority(),
                     path_prefix);
}

Result<MoonrakerAddress> ParseMoonrakerAddress(std::string_view text) {
  if (text.empty() || text.size() > kMaxAddress) {
    return BadAddress(text, text.empty() ? "it is empty" : "it is too long");
  }
  if (text.starts_with("unix:")) return ParseUnix(text, text.substr(5));
  if (!std::all_of(text.begin(), text.end(), IsPlain)) {
    return BadAddress(text, "it has a blank, a quote, an @ or a character that is not ASCII");
  }
  MoonrakerAddress address;
  address.port = 7125;
  std::string_view rest = text;
  if (const std::size_t scheme = text.find("://"); scheme != std::string_view::npos) {
    const std::string_view name = text.substr(0, scheme);
    const bool tls = name == "https" || name == "wss";
    if (!tls && name != "http" && name != "ws") {
      return BadAddress(text, fmt::format("'{}' is none of ws, wss, http, https", name));
    }
    address.transport = tls ? Transport::kTls : Transport::kTcp;
    address.port = tls ? 443 : 80;
    rest.remove_prefix(scheme + 3);
  }
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  if (!ParseHostAndPort(rest.substr(0, slash), address)) {
    return BadAddress(text, "it has no host name, or its port is not 1 … 65535");
  }
  std::string_view path = rest.substr(slash);
  if (path.find_first_of("?#") != std::string_view::npos) {
    return BadAddress(text, "it has a ? or #; a key or token belongs in its own setting");
  }
  while (path.ends_with('/')) path.remove_suffix(1);
  if (path.ends_with("/websocket")) path.remove_suffix(std::string_view("/websocket").size());
  address.path_prefix = path;
  return address;
}

Endpoint EndpointOf(const MoonrakerAddress& address, const MoonrakerOptions& options) {
  Endpoint endpoint;
  endpoint.host = address.host;
  endpoint.port = address.port;
  endpoint.tls = address.transport == Transport::kTls;
  endpoint.verify_certificate = !options.accept_any_certificate;
  endpoint.ca_file = options.ca_file;
  endpoint.trust_system = options.ca_file.empty();
  endpoint.time_limit_s = options.connect_time_limit_s;
  endpoint.server = "Moonraker";
  endpoint.port_hint = " (Moonraker's own is 7125)";
  endpoint.plain = "http:// or ws:// (Moonraker itself listens without TLS on port 7125)";
  return endpoint;
}

std::string HttpRefusal(int status, std::string_view server, const MoonrakerAddress& address,
                        bool had_key) {
  const std::string who = server.empty()
                              ? address.Authority()
                              : fmt::format("{} ({})", address.Authority(), server.substr(0, 80));
  if (status == 401 || status == 403) {
    return fmt::format(
        "{} does not let us in (HTTP {}): {}; Moonraker shows its key under Settings in Mainsail "
        "or Fluidd, or add this computer to trusted_clients in moonraker.conf",
        who, status, had_key ? "the API key or token is wrong" : "it wants an API key");
  }
  if (status == 502 || status == 503 || status == 504) {
    return fmt::format(
        "{} stands in front of a Moonraker that does not answer (HTTP {}); check that Moonraker "
        "runs",
        who, status);
  }
  constexpr int kNotThere = 404;
  const std::string prefix =
      status != kNotThere
          ? ""
          : fmt::format(
                "; where moonraker.conf has a route_prefix, write it behind the port: {}/PREFIX",
                address.Authority());
  return fmt::format(
      "{} is a web server but not a Moonraker: it answered HTTP {} to {}; check the host and port "
      "(Moonraker's own is 7125){}",
      who, status, address.WebSocketUrl(), prefix);
}

}  // namespace trammel::machine
