// What answers that are none amount to, in words.
#include <fmt/format.h>

#include "machine/moonraker/moonraker.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kMessagesInErrors = 6;
constexpr int kNotFound = -32601;
constexpr int kInvalidParameters = -32602;  // Moonraker's "Unauthorized" too
constexpr int kUnavailable = 503;

bool IsUnauthorized(const RpcAnswer& answer) {
  return answer.code == 401 || (answer.code == kInvalidParameters &&
                                (answer.message.find("nauthorized") != std::string::npos ||
                                 answer.message.find("API Key") != std::string::npos));
}

}  // namespace

Error Moonraker::ToError(const std::string& method, const RpcAnswer& answer) const {
  const std::string who = address().WebSocketUrl();
  std::string text;
  if (answer.kind == RpcAnswer::Kind::kLost) {
    text = fmt::format("{} was not answered: {}", method, answer.message);
  } else if (answer.kind == RpcAnswer::Kind::kNotSent) {
    text = fmt::format("{} was not sent: {}", method, answer.message);
  } else if (IsUnauthorized(answer)) {
    text = fmt::format(
        "{} does not let us in ({}): {}; Mainsail and Fluidd show the API key in their settings; "
        "or add this computer to trusted_clients in moonraker.conf",
        who, answer.message,
        options_.api_key.empty() ? "it wants an API key" : "the API key is wrong");
  } else if (answer.code == kNotFound && method.starts_with("printer.") &&
             readiness_ == PrinterReadiness::kDisconnected) {
    // Moonraker knows the printer's calls only from Klipper, once that was there.
    text = fmt::format(
        "{} failed: Klipper has not come to {} since that was started; start Klipper, or look at "
        "klippy.log",
        method, who);
  } else if (answer.code == kNotFound) {
    text =
        fmt::format("{} does not know the call {} ({}); update Moonraker, or is it something else?",
                    who, method, answer.message);
  } else if (answer.code == kUnavailable) {
    text = fmt::format(
        "{} failed: {}; Klipper is not running or restarts: look at its log, then FIRMWARE_RESTART",
        method, answer.message);
  } else {
    text = fmt::format("{} failed: {} (code {})", method, answer.message, answer.code);
  }
  return {ErrorKind::kMachine, text + LastMessages()};
}

std::string Moonraker::LastMessages() const {
  if (!options_.quote_messages) return "";
  const std::string excerpt = log().Excerpt(kMessagesInErrors);
  return excerpt.empty() ? "" : "\n  the last messages (> ours, < the printer's):" + excerpt;
}

}  // namespace trammel::machine
