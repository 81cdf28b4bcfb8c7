#include "base/url_secrets.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

namespace trammel {
namespace {

constexpr std::string_view kEllipsis = "…";

bool SpeaksOfSecrets(std::string_view name) {
  constexpr std::array<std::string_view, 10> kWords = {
      "token", "key", "auth", "pass", "pwd", "secret", "sig", "session", "login", "credential"};
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::any_of(kWords.begin(), kWords.end(),
                     [&](std::string_view word) { return lower.find(word) != std::string::npos; });
}

// Finds the end of user and password before the host: the position of their @, or npos. A password
// may contain its own terminator by mistake (a slash, a question mark, another @): in doubt too
// much counts as password. Text without a scheme counts if it matches user:password@….
std::size_t EndOfUser(std::string_view address) {
  constexpr std::string_view kBeginsHost = "://";
  constexpr std::string_view kEndsHost = "/?#";
  const std::size_t scheme = address.substr(0, address.find('?')).find(kBeginsHost);
  const std::size_t begin = scheme == std::string_view::npos ? 0 : scheme + kBeginsHost.size();
  const std::string_view rest = address.substr(begin);
  const std::size_t end = std::min(rest.find_first_of(kEndsHost), rest.size());
  const std::string_view host = rest.substr(0, end);
  const std::size_t colon = host.find(':');
  const std::size_t last = rest.rfind('@');
  if (last == std::string_view::npos) return last;
  if (scheme == std::string_view::npos) {
    const bool one_word = rest.substr(0, last).find_first_of(" \t\r\n\"") == std::string_view::npos;
    return one_word && colon != std::string_view::npos && colon > 0 ? last : std::string_view::npos;
  }
  const bool port = colon == std::string_view::npos || host.starts_with('[') ||
                    host.find_first_not_of("0123456789", colon + 1) == std::string_view::npos;
  const bool cut = !port || (end < rest.size() && rest[end] != '/');
  const std::size_t at = cut ? last : rest.substr(0, rest.find('?')).rfind('@');
  return at == std::string_view::npos ? at : begin + at;
}

std::string HideOnce(std::string_view address) {
  std::string shown;
  std::string_view rest = address;
  if (const std::size_t at = EndOfUser(address); at != std::string_view::npos) {
    const std::size_t scheme = address.substr(0, at).find("://");
    if (scheme != std::string_view::npos) shown = address.substr(0, scheme + 3);
    shown += kEllipsis;
    rest.remove_prefix(at);
  }
  const std::size_t query = std::min(rest.find('?'), rest.size());
  shown += rest.substr(0, query);
  rest.remove_prefix(query);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find_first_of("&;#", 1), rest.size());
    const std::string_view field = rest.substr(0, end);
    const std::size_t equals = field.find('=');
    const bool secret =
        equals != std::string_view::npos && SpeaksOfSecrets(field.substr(0, equals));
    shown += field.substr(0, secret ? equals + 1 : field.size());
    if (secret) shown += kEllipsis;
    rest.remove_prefix(end);
  }
  return shown;
}

}  // namespace

std::string WithoutSecrets(std::string_view address) {
  std::string shown = HideOnce(address);
  // The text after a removed password may match as another password.
  for (std::string next = HideOnce(shown); next != shown; next = HideOnce(shown)) {
    shown = std::move(next);
  }
  return shown;
}

}  // namespace trammel
