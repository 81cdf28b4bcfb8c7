#include "machine/camera/camera_url.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string_view>
#include <utility>

#include "base/url_secrets.h"
#include "base/utf8.h"
#include "machine/camera/camera.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestUrl = 4096;
constexpr std::size_t kLongestShown = 300;

/// For messages.
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

/// "host", "host:port", "[v6]:port" into the url.
Result<void> ParseHost(const std::string& text, std::string_view host, CameraUrl& url) {
  std::string_view port;
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) {
      return Fail(fmt::format("camera address '{}': '[' without ']' in the host", Shown(text)));
    }
    port = host.substr(end + 1);
    url.host = host.substr(1, end - 1);
  } else {
    const std::size_t colon = std::min(host.find(':'), host.size());
    port = host.substr(colon);
    url.host = host.substr(0, colon);
  }
  if (url.host.empty()) return Fail(fmt::format("camera address '{}': names no host", Shown(text)));
  if (url.host.find_first_of("[]") != std::string::npos) {
    return Fail(fmt::format("camera address '{}': a bracket stands within its host", Shown(text)));
  }
  if (port.empty()) return {};
  const std::string_view digits = port.substr(1);
  int value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (port.front() != ':' || error != std::errc{} || end != digits.data() + digits.size() ||
      value < 1 || value > 65535) {
    return Fail(
        fmt::format("camera address '{}': its port is not a number from 1 to 65535", Shown(text)));
  }
  url.port = static_cast<std::uint16_t>(value);
  return {};
}

}  // namespace

std::string CameraUrl::Address() const {
  const bool v6 = host.find(':') != std::string::npos;
  const bool standard = port == (tls ? 443 : 80);
  return fmt::format("{}://{}{}{}{}{}", tls ? "https" : "http", v6 ? "[" : "", host, v6 ? "]" : "",
                     standard ? "" : fmt::format(":{}", port), target);
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
  TRY(ParseHost(text, authority, url));
  url.target = rest.empty() || rest.front() == '?' ? "/" + std::string(rest) : std::string(rest);
  return url;
}

}  // namespace trammel::machine
