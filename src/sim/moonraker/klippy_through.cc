// What the virtual Moonraker passes through to Klipper, over a connection that a client has there.
#include <fmt/format.h>

#include <algorithm>

#include "sim/moonraker/hub.h"

namespace trammel::sim {

std::optional<std::uint64_t> Hub::OpenThrough(Peer& peer, bool authorised) {
  if (State() == KlippyState::kDisconnected) return std::nullopt;
  const std::optional<std::uint64_t> number = Open(peer, authorised);
  if (!number) return number;
  Connection& connection = connections_[*number];
  if (!connection.authorised) {
    connections_.erase(*number);
    return std::nullopt;
  }
  connection.through = true;
  return number;
}

void Hub::ReceiveThrough(std::uint64_t number, const Json& request) {
  const std::optional<std::string> endpoint = TextOf(request, "method");
  const Json params = request.value("params", Json::object());
  if (!endpoint || !params.is_object()) return;  // Klipper logs it, and says nothing
  std::string method = "printer." + *endpoint;
  std::replace(method.begin(), method.end(), '/', '.');
  const Reply reply = [this, number, id = request.value("id", Json())](const Answer& answer) {
    if (id.is_null()) return;
    Json text = {{"id", id}};
    if (answer.error) {
      text["error"] = {{"error", "WebRequestError"}, {"message", answer.error->message}};
    } else {
      text["result"] = answer.result;
    }
    Send(number, ToText(text));
  };
  if (!CallPrinter(number, method, params, reply)) {
    reply(Answer::Error(400,
                        fmt::format("webhooks: No registered callback for path '{}'", *endpoint)));
  }
}

}  // namespace trammel::sim
