#include "machine/moonraker/moonraker_address.h"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <charconv>

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

bool IsPort(std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

/// Splits "host:port" or "[v6]:port"; leaves the port alone where there is none.
bool SplitAuthority(std::string_view text, MoonrakerAddress& address) {
  std::string_view after;
  if (text.starts_with('[')) {
    const std::size_t close = text.find(']');
    if (close == std::string_view::npos) {
      return false;
    }
    address.host = text.substr(1, close - 1);
    after = text.substr(close + 1);
  } else {
    const std::size_t colon = text.find(':');
    address.host = text.substr(0, colon);
    after = colon == std::string_view::npos ? std::string_view() : text.substr(colon);
  }
  if (address.host.empty() || address.host.find_first_of("[]") != std::string::npos) return false;
  if (after.empty()) return true;
  address.port = after.substr(1);
  return after.starts_with(':') && IsPort(address.port);
}

Result<MoonrakerAddress> ParseUnix(std::string_view text, std::string_view path) {
  while (path.starts_with("//")) {
    path.remove_prefix(1);
  }
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

std::string MoonrakerAddress::Authority() const {
  const bool v6 = host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", v6 ? "[" : "", host, v6 ? "]" : "", port);
}

std::string MoonrakerAddress::WebSocketUrl() const {
  if (transport == Transport::kUnix) {
    return "unix:" + unix_path;
  }
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
  if (text.starts_with("unix:")) {
    return ParseUnix(text, text.substr(5));
  }
  if (!std::all_of(text.begin(), text.end(), IsPlain)) {
    return BadAddress(text, "it has a blank, a quote, an @ or a character that is not ASCII");
  }
  MoonrakerAddress address;
  address.port = "7125";
  std::string_view rest = text;
  if (const std::size_t scheme = text.find("://"); scheme != std::string_view::npos) {
    const std::string_view name = text.substr(0, scheme);
    const bool tls = name == "https" || name == "wss";
    if (!tls && name != "http" && name != "ws") {
      return BadAddress(text, fmt::format("'{}' is none of ws, wss, http, https", name));
    }
    address.transport = tls ? Transport::kTls : Transport::kTcp;
    address.port = tls ? "443" : "80";
    rest.remove_prefix(scheme + 3);
  }
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  if (!SplitAuthority(rest.substr(0, slash), address)) {
    return BadAddress(text, "it has no host name, or its port is not 1 … 65535");
  }
  std::string_view path = rest.substr(slash);
  if (path.find_first_of("?#") != std::string_view::npos) {
    return BadAddress(text, "it has a ? or #; a key or token belongs in its own setting");
  }
  while (path.ends_with('/')) {
    path.remove_suffix(1);
  }
  if (path.ends_with("/websocket")) {
    path.remove_suffix(std::string_view("/websocket").size());
  }
  address.path_prefix = path;
  return address;
}

}  // namespace trammel::machine
