// Agents of the virtual Moonraker: identification, events, and requests from others.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "sim/moonraker/hub.h"

namespace trammel::sim {
namespace {

bool IsAgent(const std::optional<Json>& client) { return client && (*client)["type"] == "agent"; }

}  // namespace

Answer Hub::Identify(Connection& connection, std::uint64_t number, const Json& params) {
  if (connection.client) {
    const auto known = [&](const char* key) {
      return (*connection.client)[key].get<std::string>();
    };
    return Answer::Error(
        400, fmt::format("Connection already identified: {{'name': '{}', 'version': '{}', 'type': "
                         "'{}', 'url': '{}'}}",
                         known("name"), known("version"), known("type"), known("url")));
  }
  Json client = Json::object();
  for (const char* key : {"client_name", "version", "type", "url"}) {
    const std::optional<std::string> value = TextOf(params, key);
    if (!value) return NoData(key);
    client[key == std::string_view("client_name") ? "name" : key] = *value;
  }
  if (!connection.authorised) {
    const std::optional<std::string> key = TextOf(params, "api_key");
    if (!key || !KeyIsRight(*key)) return Answer::Error(401, "Unauthorized");
  }
  constexpr std::array<const char*, 7> kTypes = {"web", "mobile", "desktop", "display",
                                                 "bot", "agent",  "other"};
  const std::string type = client["type"];
  if (std::find(kTypes.begin(), kTypes.end(), type) == kTypes.end()) {
    return Answer::Error(400, "Invalid Client Type: " + type);
  }
  connection.authorised = true;
  const bool taken = type == "agent" && AgentNumber(client["name"]).has_value();
  connection.client = client;
  if (taken) {  // the connection counts as identified all the same, as nothing in particular
    (*connection.client)["type"] = "";
    return Answer::Error(400, fmt::format("Agent '{}' already registered and connected'",
                                          client["name"].get<std::string>()));
  }
  if (type == "agent") {
    ForwardAgentEvent(number,
                      {{"agent", client["name"]}, {"event", "connected"}, {"data", client}});
  }
  return Answer::Ok({{"connection_id", number}});
}

Answer Hub::RegisterRemote(Connection& connection, const Json& params) {
  constexpr std::size_t kMaxMethods = 100;
  const std::optional<std::string> name = TextOf(params, "method_name");
  if (!name) return NoData("method_name");
  if (!IsAgent(connection.client)) {
    return Answer::Error(400, "Only connections of the 'agent' type can register methods");
  }
  for (const auto& [number, other] : connections_) {
    if (other.remote_methods.count(*name) > 0) {
      return Answer::Error(400, fmt::format("Remote method ({}) already registered", *name));
    }
  }
  if (connection.remote_methods.size() >= kMaxMethods) {
    return Answer::Error(400, "Too many remote methods");
  }
  connection.remote_methods.insert(*name);
  machine_.With([&](VirtualKlipper& klipper) { klipper.RegisterRemoteMethod(*name); });
  return Answer::Ok();
}

std::optional<std::uint64_t> Hub::AgentNumber(const std::string& name) const {
  for (const auto& [number, connection] : connections_) {
    if (IsAgent(connection.client) && (*connection.client)["name"] == name) return number;
  }
  return std::nullopt;
}

void Hub::ForwardAgentEvent(std::uint64_t agent, const Json& event) {
  Notify("notify_agent_event", Json::array({event}), agent);
}

Answer Hub::SendAgentEvent(const Connection& connection, std::uint64_t number, const Json& params) {
  if (!IsAgent(connection.client)) {
    return Answer::Error(400, "Only connections of the 'agent' type can send events");
  }
  const std::optional<std::string> event = TextOf(params, "event");
  if (!event) return NoData("event");
  if (*event == "connected" || *event == "disconnected") {
    return Answer::Error(400, fmt::format("Event '{}' is reserved", *event));
  }
  Json told = {{"agent", (*connection.client)["name"]}, {"event", *event}};
  const auto data = params.find("data");
  if (data != params.end() && !data->is_null()) told["data"] = *data;
  ForwardAgentEvent(number, told);
  return Answer::Ok();
}

Json Hub::Agents() const {
  Json agents = Json::array();
  for (const auto& [number, connection] : connections_) {
    if (IsAgent(connection.client)) agents.push_back(*connection.client);
  }
  return {{"agents", agents}};
}

void Hub::AskAgent(const Json& params, const Reply& reply) {
  constexpr std::size_t kMaxAsked = 1000;  // pending requests to a silent agent
  const std::optional<std::string> agent = TextOf(params, "agent");
  if (!agent) return reply(NoData("agent"));
  const std::optional<std::string> method = TextOf(params, "method");
  if (!method) return reply(NoData("method"));
  const Json arguments = params.value("arguments", Json(nullptr));
  if (!arguments.is_null() && !arguments.is_structured()) {
    return reply(Answer::Error(400, "The 'arguments' field must contain an object or a list"));
  }
  const std::optional<std::uint64_t> number = AgentNumber(*agent);
  if (!number) return reply(Answer::Error(400, fmt::format("Agent {} not connected", *agent)));
  Connection& connection = connections_[*number];
  if (connection.asked.size() >= kMaxAsked) {
    return reply(Answer::Error(400, "Too many requests wait"));
  }
  const std::int64_t id = next_request_++;
  connection.asked[id] = reply;
  Json request = {{"jsonrpc", "2.0"}, {"method", *method}, {"id", id}};
  // An empty object or list is omitted, like an absent one.
  if (arguments.is_structured() && !arguments.empty()) request["params"] = arguments;
  Send(*number, ToText(request));
}

// There is no time limit: a request to an agent that never answers waits forever.
void Hub::TakeAgentAnswer(std::uint64_t number, const Json& message) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_integer()) return;
  Connection& connection = connections_[number];
  const auto found = connection.asked.find(id->get<std::int64_t>());
  if (found == connection.asked.end()) return;
  const Reply reply = std::move(found->second);
  connection.asked.erase(found);
  const Json result = message.value("result", Json(nullptr));
  if (!result.is_null()) return reply(Answer::Ok(result));
  const std::string name = connection.client ? (*connection.client)["name"] : "unknown";
  Answer failed = Answer::Error(424, fmt::format("Agent {} RPC error", name));
  failed.error->data = message.value("error", Json(nullptr));
  reply(failed);
}

void Hub::EndAgent(std::uint64_t number, const Connection& connection) {
  const Answer gone = Answer::Error(500, "Client Socket Disconnected");
  for (const auto& [id, reply] : connection.asked) reply(gone);
  if (!IsAgent(connection.client)) return;
  ForwardAgentEvent(number, {{"agent", (*connection.client)["name"]}, {"event", "disconnected"}});
}

}  // namespace trammel::sim
