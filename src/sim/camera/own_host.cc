#include "sim/camera/own_host.h"

#include <algorithm>
#include <cctype>
#include <string>

namespace trammel::sim {

bool IsOwnHost(std::string_view host) {
  if (host.empty()) return true;
  const bool v6 = host.front() == '[';
  const std::size_t name_end = v6 ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  std::string name(host.substr(0, name_end));
  std::string_view port = host.substr(name.size());
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (!port.empty() && port.front() != ':') return false;
  if (!port.empty()) port.remove_prefix(1);
  const bool digits =
      std::all_of(port.begin(), port.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return digits && (name == "127.0.0.1" || name == "localhost" || name == "[::1]");
}

bool IsOwnOrigin(std::string_view origin) {
  if (origin.empty()) return true;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) {
      const std::string_view host = origin.substr(scheme.size());
      return !host.empty() && IsOwnHost(host);
    }
  }
  return false;  // "null", an extension, a file
}

}  // namespace trammel::sim
