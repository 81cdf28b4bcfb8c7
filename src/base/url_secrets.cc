#include "base/url_secrets.h"

#include <algorithm>
#include <array>
#include <cctype>

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

}  // namespace

std::string WithoutSecrets(std::string_view address) {
  const std::size_t query = std::min(address.find('?'), address.size());
  std::string_view before = address.substr(0, query);
  std::string shown;
  if (const std::size_t scheme = before.find("://"); scheme != std::string_view::npos) {
    shown = before.substr(0, scheme + 3);
    before.remove_prefix(scheme + 3);
    // The last @, although one belongs into a path: a password may hold a slash by mistake.
    if (const std::size_t at = before.rfind('@'); at != std::string_view::npos) {
      shown += kEllipsis;
      before.remove_prefix(at);
    }
  }
  shown += before;
  std::string_view rest = address.substr(query);
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

}  // namespace trammel
