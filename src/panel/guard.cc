#include "panel/guard.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/address.hpp>
#include <cctype>

#include "base/text.h"

namespace trammel::panel {
namespace {

namespace ip = boost::asio::ip;

std::string OwnName() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return {};
  return LowerCase(name.data());
}

bool IsNumber(const std::string& name) {
  boost::system::error_code error;
  (void)ip::make_address(name, error);
  return !error;
}

// A page of another site can never open the panel under an address in numbers, since its browser
// sends the name of that site.
bool MayBeOpenedAs(const std::string& name, const GuardOptions& options) {
  if (name.empty()) return false;
  if (IsNumber(name) || name == "localhost") return true;
  const std::string own = OwnName();
  if (!own.empty() && (name == own || name == own + ".local")) return true;
  return std::ranges::any_of(options.names,
                             [&](const std::string& known) { return LowerCase(known) == name; });
}

bool Changes(std::string_view method) { return method != "GET" && method != "HEAD"; }

// True for a request of the panel's own page, or of a program that is no browser.
bool IsOurs(const RequestHead& head) {
  if (head.origin.empty()) {
    return head.fetch_site.empty() || head.fetch_site == "same-origin" || head.fetch_site == "none";
  }
  const std::size_t begin = head.origin.find("://");
  return begin != std::string_view::npos &&
         LowerCase(head.origin.substr(begin + 3)) == LowerCase(head.host);
}

constexpr std::string_view kTypes[] = {"application/json", "application/octet-stream",
                                       "image/jpeg",       "image/png",
                                       "image/webp",       "image/heic",
                                       "image/heif",       "image/tiff",
                                       "application/pdf"};

bool IsPrivate(const ip::address_v4& address) {
  const auto bytes = address.to_bytes();
  return address.is_loopback() || bytes[0] == 10 || (bytes[0] == 172 && bytes[1] >> 4 == 1) ||
         (bytes[0] == 192 && bytes[1] == 168) || (bytes[0] == 169 && bytes[1] == 254);
}

}  // namespace

std::string HostName(std::string_view host) {
  constexpr std::size_t kLongest = 253;  // of a name in DNS
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return {};
    const std::string number = LowerCase(host.substr(1, end - 1));
    return number.find_first_not_of("0123456789abcdef:.") == std::string::npos ? number : "";
  }
  std::string name = LowerCase(host.substr(0, host.find(':')));
  if (name.ends_with('.')) name.pop_back();
  const bool plain = name.size() <= kLongest && std::ranges::all_of(name, [](unsigned char c) {
                       return std::isalnum(c) || c == '.' || c == '-' || c == '_';
                     });
  return plain ? name : std::string();
}

std::optional<Denial> CheckRequest(const RequestHead& head, const GuardOptions& options) {
  const std::string name = HostName(head.host);
  if (!MayBeOpenedAs(name, options)) {
    return Denial{421, fmt::format("this panel does not know itself as '{}'. If that name is this "
                                   "computer's, add it: trammel serve --panel-name {}",
                                   name, name.empty() ? "NAME" : name)};
  }
  if (!Changes(head.method) && !head.upgrades) return std::nullopt;
  if (!IsOurs(head)) {
    return Denial{403, fmt::format("the request comes from the page {}, not from the panel's own. "
                                   "A proxy in between must pass on the Host that the browser sent",
                                   head.origin.empty() ? "of another site" : head.origin)};
  }
  if (Changes(head.method) && std::ranges::find(kTypes, head.content_type) == std::end(kTypes)) {
    return Denial{415, fmt::format("content of type '{}' is not accepted: a photo is JPEG, PNG, "
                                   "WebP or HEIC, a scan also PDF or TIFF",
                                   head.content_type)};
  }
  return std::nullopt;
}

bool IsNearby(std::string_view address) {
  boost::system::error_code error;
  const ip::address parsed = ip::make_address(std::string(address), error);
  if (error) return false;
  if (parsed.is_v4()) return IsPrivate(parsed.to_v4());
  const ip::address_v6 six = parsed.to_v6();
  if (six.is_v4_mapped()) return IsPrivate(ip::make_address_v4(ip::v4_mapped, six));
  constexpr unsigned kUniqueLocal = 0xfc;  // RFC 4193: fc00::/7
  return six.is_loopback() || six.is_link_local() || (six.to_bytes()[0] & 0xfe) == kUniqueLocal;
}

std::string ContentSecurityPolicy(std::string_view host) {
  if (host.empty()) return "default-src 'none'; frame-ancestors 'none'";
  const bool six = host.find(':') != std::string_view::npos;
  const std::string place = six ? fmt::format("[{}]", host) : std::string(host);
  return fmt::format(
      "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
      "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self' "
      "http://{0}:* "
      "https://{0}:*",
      place);
}

}  // namespace trammel::panel
