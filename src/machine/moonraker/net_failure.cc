#include "machine/moonraker/net_failure.h"

#include <fmt/format.h>

#include <boost/asio/error.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/http/error.hpp>

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;

std::string LookUpFailure(const boost::system::error_code& error, const MoonrakerAddress& address) {
  return fmt::format(
      "cannot find a computer named '{}': {}; check the spelling and that it is switched on, or "
      "give its number (like 192.168.1.20)",
      address.host, error.message());
}

std::string ConnectFailure(const boost::system::error_code& error, const MoonrakerAddress& address,
                           double time_limit_s) {
  if (error == asio::error::connection_refused) {
    return fmt::format(
        "{} refuses connections: nothing listens on that port; check that Moonraker runs there and "
        "the port (Moonraker's own is 7125)",
        address.Authority());
  }
  if (error == beast::error::timeout || error == asio::error::timed_out) {
    return fmt::format(
        "{} did not answer within {} s; check that the computer is on and reachable from here, and "
        "that no firewall stands between",
        address.Authority(), time_limit_s);
  }
  return fmt::format("cannot connect to {}: {}; check the address and the network",
                     address.Authority(), error.message());
}

}  // namespace

std::string NetFailure(NetStep step, const boost::system::error_code& error,
                       const MoonrakerAddress& address, double time_limit_s) {
  if (step == NetStep::kLookUp) {
    return LookUpFailure(error, address);
  }
  if (step == NetStep::kConnect) {
    return ConnectFailure(error, address, time_limit_s);
  }
  if (error == beast::error::timeout) {
    return fmt::format(
        "{} took the connection but said nothing within {} s; is that port Moonraker's?",
        address.Authority(), time_limit_s);
  }
  const bool not_http =
      error.category() == make_error_code(beast::http::error::bad_version).category();
  return fmt::format("{} is not a Moonraker: {} ({}); check the port (Moonraker's own is 7125)",
                     address.Authority(),
                     not_http ? "what it says is not HTTP" : "it broke off the conversation",
                     error.message());
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
