#include "machine/net/endpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace trammel::machine {

std::string HostAndPort::Authority() const {
  const bool v6 = host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", v6 ? "[" : "", host, v6 ? "]" : "", port);
}

bool ParseHostAndPort(std::string_view text, HostAndPort& into) {
  std::string_view host = text.substr(0, text.find(':'));
  std::string_view after = text.substr(host.size());
  if (text.starts_with('[')) {
    const std::size_t close = text.find(']');
    if (close == std::string_view::npos) return false;
    host = text.substr(1, close - 1);
    after = text.substr(close + 1);
  }
  if (host.empty() || host.find_first_of("[]") != std::string_view::npos) return false;
  into.host = host;
  if (after.empty()) return true;
  if (!after.starts_with(':')) return false;
  after.remove_prefix(1);
  unsigned port = 0;
  const auto [end, error] = std::from_chars(after.data(), after.data() + after.size(), port);
  into.port = static_cast<std::uint16_t>(port);
  return error == std::errc() && end == after.data() + after.size() && port >= 1 && port <= 65535;
}

}  // namespace trammel::machine
