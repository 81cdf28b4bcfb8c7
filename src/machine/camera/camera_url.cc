#include "machine/camera/camera_url.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "base/url_secrets.h"
#include "base/utf8.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestUrl = 4096;
constexpr std::size_t kLongestShown = 300;

/// Formats an address for messages.
std::string Shown(std::string_view address) {
  return Utf8OrReplaced(WithoutSecrets(address), kLongestShown);
}

bool StartsWithIgnoringCase(std::string_view text, std::string_view start) {
  return text.size() >= start.size() &&
         std::equal(start.begin(), start.end(), text.begin(), [](char a, char b) {
           return a == std::tolower(static_cast<unsigned char>(b));
         });
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string PercentDecoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 &&
        HexDigit(text[i + 2]) >= 0) {
      decoded += static_cast<char>(HexDigit(text[i + 1]) * 16 + HexDigit(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

}  // namespace

std::string CameraUrl::Address() const {
  std::string where = Authority();
  if (port == (tls ? 443 : 80)) where.resize(where.rfind(':'));
  return fmt::format("{}://{}{}", tls ? "https" : "http", where, target);
}

std::string CameraUrl::ToString() const { return Shown(Address()); }

bool IsHttpUrl(const std::string& text) {
  return StartsWithIgnoringCase(text, "http://") || StartsWithIgnoringCase(text, "https://");
}

Result<CameraUrl> ParseCameraUrl(const std::string& text) {
  if (!IsHttpUrl(text)) {
    return Fail(
        fmt::format("camera address '{}': begins with neither http:// nor https://", Shown(text)));
  }
  if (text.size() > kLongestUrl) {
    return Fail(fmt::format("camera address of {} characters; at most {} are taken", text.size(),
                            kLongestUrl));
  }
  const bool bad = std::any_of(text.begin(), text.end(),
                               [](unsigned char c) { return c <= ' ' || c == 0x7F || c == '\\'; });
  if (bad) {
    return Fail(
        "camera address: holds a blank, a control character or a backslash; write %20 for "
        "a blank");
  }
  CameraUrl url;
  std::string_view rest = text;
  url.tls = StartsWithIgnoringCase(rest, "https");
  url.port = url.tls ? 443 : 80;
  rest.remove_prefix(url.tls ? 8 : 7);
  rest = rest.substr(0, rest.find('#'));
  const std::size_t authority_end = std::min(rest.find_first_of("/?"), rest.size());
  std::string_view authority = rest.substr(0, authority_end);
  rest.remove_prefix(authority_end);
  if (const std::size_t at = authority.rfind('@'); at != std::string_view::npos) {
    const std::string_view login = authority.substr(0, at);
    const std::size_t colon = std::min(login.find(':'), login.size());
    url.user = PercentDecoded(login.substr(0, colon));
    if (colon < login.size()) url.password = PercentDecoded(login.substr(colon + 1));
    authority.remove_prefix(at + 1);
  }
  if (!ParseHostAndPort(authority, url)) {
    return Fail(
        fmt::format("camera address '{}': its host cannot be read; write a name, an address in "
                    "numbers or [an IPv6 address], and behind it a port from 1 to 65535 or none",
                    Shown(text)));
  }
  url.target = rest.empty() || rest.front() == '?' ? "/" + std::string(rest) : std::string(rest);
  return url;
}

}  // namespace trammel::machine
