#include "sim/moonraker/hub.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/bounded_json.h"
#include "sim/klipper/status.h"

namespace trammel::sim {
namespace {

constexpr double kStatusEveryS = 0.25;  // machine time, as in Klipper
constexpr double kDumpEveryS = 0.5;
constexpr double kCellEveryS = 0.1;
constexpr double kDumpAheadS = 1.5;
constexpr double kTokenLifeS = 5;
constexpr std::size_t kMaxTokens = 1000;

Json Pick(const VirtualKlipper& klipper, const std::string& name,
          const std::optional<std::set<std::string>>& fields) {
  Json all = ObjectStatus(klipper, name);
  if (!fields) return all;
  Json some = Json::object();
  if (all.empty()) return all;  // there is no such object
  for (const std::string& field : *fields) some[field] = all.value(field, Json(nullptr));
  return some;
}

}  // namespace

Hub::Hub(MachineHost& machine, HubOptions options)
    : machine_(machine), options_(std::move(options)), random_(options_.seed) {}

std::optional<std::uint64_t> Hub::Open(Peer& peer, bool authorised) {
  if (refuses()) return std::nullopt;
  const std::uint64_t number = next_connection_++;
  Connection& connection = connections_[number];
  connection.peer = &peer;
  connection.authorised = authorised || options_.api_key.empty();
  return number;
}

void Hub::Close(std::uint64_t number) {
  auto left = connections_.extract(number);
  std::erase_if(dumps_, [number](const Dump& dump) { return dump.owner == number; });
  std::erase_if(queries_, [number](const Query& query) { return query.connection == number; });
  if (left) EndAgent(number, left.mapped());
}

bool Hub::KeyIsRight(const std::string& key) const {
  return options_.api_key.empty() || key == options_.api_key;
}

std::string Hub::MakeToken() {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
  if (tokens_.size() >= kMaxTokens) tokens_.clear();
  std::string token;
  for (int i = 0; i < 32; ++i) token += kLetters[random_.Below(kLetters.size())];
  tokens_[token] = monotonic_s_ + kTokenLifeS;
  return token;
}

bool Hub::TakeToken(const std::string& token) {
  const auto found = tokens_.find(token);
  if (found == tokens_.end()) return false;
  const bool good = monotonic_s_ <= found->second;
  tokens_.erase(found);
  return good;
}

void Hub::Receive(std::uint64_t number, std::string_view text) {
  // The message was still in transit when the connection was closed.
  if (connections_.count(number) == 0) return;
  const Result<Json> parsed = ParseBoundedJson(text, "the message");
  if (connections_[number].through) {
    if (parsed && parsed->is_object()) ReceiveThrough(number, *parsed);
    return Pump();
  }
  const auto refuse = [&](int code, const char* message, const Json& id) {
    Send(number,
         ToText(
             {{"jsonrpc", "2.0"}, {"error", {{"code", code}, {"message", message}}}, {"id", id}}));
  };
  if (!parsed) return refuse(-32700, "Parse error", nullptr);
  const Json& request = *parsed;
  if (!request.is_object()) return refuse(-32600, "Invalid Request", nullptr);
  const Json id = request.value("id", Json(nullptr));
  const std::optional<std::string> method = TextOf(request, "method");
  if (TextOf(request, "jsonrpc") == "2.0" && !request.contains("method")) {
    TakeAgentAnswer(number, request);
    return Pump();
  }
  if (TextOf(request, "jsonrpc") != "2.0" || !method || id.is_structured()) {
    return refuse(-32600, "Invalid Request", id.is_structured() ? Json(nullptr) : id);
  }
  const Json params = request.value("params", Json::object());
  if (!params.is_object()) return refuse(-32602, "Invalid params", id);
  Call(number, *method, params, [this, number, id](const Answer& answer) {
    if (id.is_null()) return;  // a notification wants no answer
    Json reply = {{"jsonrpc", "2.0"}, {"id", id}};
    if (answer.error) {
      // Moonraker maps two HTTP codes to JSON-RPC's own.
      const int code = answer.error->code == 404   ? -32601
                       : answer.error->code == 401 ? -32602
                                                   : answer.error->code;
      reply["error"] = {{"code", code}, {"message", answer.error->message}};
      if (answer.error->data) reply["error"]["data"] = *answer.error->data;
    } else {
      reply["result"] = answer.result;
    }
    Send(number, ToText(reply));
  });
  Pump();
}

void Hub::Request(const std::string& method, const Json& params, const Reply& reply) {
  Call(0, method, params, [this, reply](const Answer& answer) {
    if (!silent()) reply(answer);
  });
  Pump();
}

void Hub::Abandon() {
  scripts_.clear();
  queries_.clear();
  for (auto& [number, connection] : connections_) connection.asked.clear();
}

bool Hub::silent() const {
  return options_.faults.silent_from_s && time_s_ >= *options_.faults.silent_from_s;
}

void Hub::Call(std::uint64_t number, const std::string& method, const Json& params,
               const Reply& reply) {
  const auto found = connections_.find(number);
  const bool known = found != connections_.end();
  if (known && !found->second.authorised && method != "server.connection.identify") {
    return reply(Answer::Error(401, "Unauthorized"));
  }
  if (CallServer(number, method, params, reply)) return;
  if (CallPrinter(number, method, params, reply)) return;
  reply(Answer::Error(404, "Method not found"));
}

void Hub::RunScript(const std::string& script, const Reply& reply) {
  std::uint64_t id = 0;
  machine_.With([&](VirtualKlipper& klipper) { id = klipper.RunScript(script); });
  scripts_[id] = reply;
}

void Hub::MoveOn(VirtualKlipper& klipper, double monotonic_s) {
  monotonic_s_ = std::max(monotonic_s, machine_.latest_view_s());
  time_s_ = machine_.MachineTime(monotonic_s_);
  klipper.Advance(time_s_);
}

void Hub::Tick(double monotonic_s) {
  int laser_moves = 0;
  machine_.With([&](VirtualKlipper& klipper) {
    MoveOn(klipper, monotonic_s);
    laser_moves = klipper.laser_moves;
  });
  Pump();
  if (time_s_ >= next_status_s_) {
    next_status_s_ = time_s_ + kStatusEveryS;
    machine_.With([&](VirtualKlipper& klipper) {
      MoveOn(klipper, monotonic_s);
      StatusTick(klipper);
    });
  }
  if (time_s_ >= next_dump_s_) {
    next_dump_s_ = time_s_ + kDumpEveryS;
    machine_.With([&](VirtualKlipper& klipper) { DumpTick(klipper); });
  }
  if (time_s_ >= next_cell_s_) {
    next_cell_s_ = time_s_ + kCellEveryS;
    machine_.With([&](VirtualKlipper& klipper) { CellTick(klipper); });
  }
  FaultTick(time_s_, laser_moves);
}

void Hub::FaultTick(double time_s, int laser_moves) {
  ServerFaults& faults = options_.faults;
  const bool by_time = faults.close_at_s && time_s >= *faults.close_at_s;
  const bool by_move = faults.close_at_laser_move && laser_moves >= *faults.close_at_laser_move;
  if (by_time) faults.close_at_s.reset();
  if (by_move) faults.close_at_laser_move.reset();
  if (by_time || by_move) {
    refuse_until_s_ = time_s + faults.refuse_for_s;
    CloseAll();
  }
}

void Hub::CloseAll() {
  std::vector<Peer*> peers;
  for (auto& [number, connection] : connections_) peers.push_back(connection.peer);
  const auto left = std::exchange(connections_, {});
  queries_.clear();
  for (const auto& [number, connection] : left) EndAgent(number, connection);
  for (Peer* peer : peers) peer->Close();
}

// Passes on Klipper's events, in order.
void Hub::Pump() {
  std::vector<KlipperEvent> events;
  machine_.With([&](VirtualKlipper& klipper) { events = klipper.TakeEvents(); });
  for (const KlipperEvent& event : events) {
    switch (event.kind) {
      case KlipperEvent::Kind::kResponse:
        Notify("notify_gcode_response", {event.text});
        break;
      case KlipperEvent::Kind::kScriptDone: {
        const auto found = scripts_.find(event.script);
        if (found == scripts_.end()) break;
        const Reply reply = std::move(found->second);
        scripts_.erase(found);
        reply(event.error ? Answer::Error(400, *event.error) : Answer::Ok());
        break;
      }
      case KlipperEvent::Kind::kRemoteCall:
        SendToRemote(event);
        break;
      case KlipperEvent::Kind::kDisconnected:
        Disconnected();
        break;
      case KlipperEvent::Kind::kReady:
        machine_.With([&](VirtualKlipper& klipper) {
          for (const auto& [number, connection] : connections_) {
            for (const std::string& method : connection.remote_methods) {
              klipper.RegisterRemoteMethod(method);
            }
          }
        });
        Notify("notify_klippy_ready", nullptr);
        break;
    }
  }
}

void Hub::SendToRemote(const KlipperEvent& event) {
  Json params = Json::object();
  for (const KlipperEvent::Argument& argument : event.arguments) {
    params[argument.key] = argument.number ? Json(*argument.number) : Json(argument.text);
  }
  const std::string text = ToText({{"jsonrpc", "2.0"}, {"method", event.text}, {"params", params}});
  for (const auto& [number, connection] : connections_) {
    if (connection.remote_methods.count(event.text) > 0) Send(number, text);
  }
}

void Hub::Disconnected() {
  for (auto& [number, connection] : connections_) {
    connection.subscription.clear();
    connection.told = Json::object();
  }
  dumps_.clear();
  std::vector<Peer*> through;
  for (const auto& [number, connection] : connections_) {
    if (connection.through) through.push_back(connection.peer);
  }
  std::erase_if(connections_, [](const auto& entry) { return entry.second.through; });
  for (Peer* peer : through) peer->Close();
  told_shutdown_ = false;
  const auto scripts = std::exchange(scripts_, {});
  const auto queries = std::exchange(queries_, {});
  const Answer gone = Answer::Error(503, "Klippy Disconnected");
  for (const auto& [id, reply] : scripts) reply(gone);
  for (const Query& query : queries) query.reply(gone);
  Notify("notify_klippy_disconnected", nullptr);
}

void Hub::StatusTick(VirtualKlipper& klipper) {
  if (klipper.state() == KlippyState::kDisconnected) return;
  const Json time = EventTime();
  for (auto& [number, connection] : connections_) {
    Json changed = Json::object();
    for (const auto& [name, fields] : connection.subscription) {
      const Json now = Pick(klipper, name, fields);
      Json& told = connection.told[name];
      for (const auto& [field, value] : now.items()) {
        if (!told.is_object() || told.value(field, Json()) != value) changed[name][field] = value;
      }
      told = now;
    }
    if (!changed.empty()) {
      Send(number, ToText({{"jsonrpc", "2.0"},
                           {"method", "notify_status_update"},
                           {"params", {changed, time}}}));
    }
  }
  const auto queries = std::exchange(queries_, {});
  for (const Query& query : queries) {
    Json status = Json::object();
    for (const auto& [name, fields] : query.objects) status[name] = Pick(klipper, name, fields);
    const auto found = connections_.find(query.connection);
    if (query.subscribe && found != connections_.end()) {
      found->second.subscription = query.objects;
      found->second.told = status;
    }
    query.reply(Answer::Ok({{"eventtime", time}, {"status", status}}));
  }
  if (klipper.state() == KlippyState::kShutdown && !told_shutdown_) {
    told_shutdown_ = true;
    Notify("notify_klippy_shutdown", nullptr);
  }
}

void Hub::DumpTick(VirtualKlipper& klipper) {
  const MotionQueue& motion = klipper.motion();
  for (Dump& dump : dumps_) {
    if (dump.source != "toolhead" && dump.source != "extruder") continue;
    Json data = Json::array();
    for (; dump.next < motion.forgotten() + motion.decided().size(); ++dump.next) {
      if (dump.next < motion.forgotten()) continue;
      const PlannedMove& move = motion.decided()[dump.next - motion.forgotten()];
      if (move.timed.start_s > klipper.print_now_s() + kDumpAheadS) break;
      for (const TrapqEntry& entry :
           dump.source == "toolhead" ? ToolheadTrapq(move) : ExtruderTrapq(move)) {
        data.push_back({entry.time_s, entry.duration_s, entry.start_velocity, entry.acceleration,
                        entry.start, entry.direction});
      }
    }
    if (!data.empty()) SendDump(dump, {{"data", data}});
  }
}

void Hub::SendDump(const Dump& dump, const Json& params) {
  if (dump.owner != 0) {
    return Send(dump.owner, ToText({{"method", dump.method}, {"params", params}}));
  }
  const std::string text =
      ToText({{"jsonrpc", "2.0"}, {"method", dump.method}, {"params", params}});
  for (const auto& [number, connection] : connections_) {
    if (connection.remote_methods.count(dump.method) > 0) Send(number, text);
  }
}

void Hub::Notify(const std::string& method, const Json& params, std::uint64_t except) {
  Json message = {{"jsonrpc", "2.0"}, {"method", method}};
  if (!params.is_null()) message["params"] = params;
  const std::string text = ToText(message);
  for (const auto& [number, connection] : connections_) {
    if (number != except && connection.authorised && !connection.through) Send(number, text);
  }
}

void Hub::Send(std::uint64_t number, const std::string& text) {
  if (silent()) return;
  const auto found = connections_.find(number);
  if (found != connections_.end()) found->second.peer->Send(text);
}

Json Hub::EventTime() const { return monotonic_s_ + RawLessMonotonic(); }

bool Hub::HasLoadCell() const {
  bool has = false;
  machine_.With([&](VirtualKlipper& klipper) { has = klipper.cell() != nullptr; });
  return has;
}

KlippyState Hub::State() const {
  KlippyState state = KlippyState::kDisconnected;
  machine_.With([&](VirtualKlipper& klipper) { state = klipper.state(); });
  return state;
}

}  // namespace trammel::sim
