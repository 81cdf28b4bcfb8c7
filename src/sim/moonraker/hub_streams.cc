// Streams of the virtual Klipper: requests passed through to it, and its load cell data.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

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

namespace {

// Formats a tap's moves as Klipper's forks report them.
Json MovesOf(const ProbedTap& tap) {
  Json moves = Json::array();
  for (const ZMove& move : tap.moves) {
    moves.push_back({{"print_time", move.start_time_s},
                     {"move_t", move.duration_s},
                     {"start_v", move.start_velocity_mm_s},
                     {"accel", move.acceleration_mm_s2},
                     {"start_x", tap.x_mm},
                     {"start_y", tap.y_mm},
                     {"start_z", move.start_z_mm},
                     {"x_r", 0.0},
                     {"y_r", 0.0},
                     {"z_r", move.z_direction}});
  }
  return moves;
}

}  // namespace

Answer Hub::StartCellDump(std::uint64_t connection, const std::string& method, const Json& params) {
  const bool taps = method == "printer.load_cell_probe.dump_taps";
  const char* key = taps ? "load_cell_probe" : "load_cell";
  const std::optional<std::string> name = TextOf(params, key);
  if (!name) return Answer::Error(400, fmt::format("Missing Argument [{}]", key));
  if (*name != "load_cell_probe") {
    return Answer::Error(400, fmt::format("The value '{}' is not valid for {}", *name, key));
  }
  std::size_t next = 0;
  machine_.With([&](VirtualKlipper& klipper) {
    next = taps ? klipper.history().taps.size()
                : klipper.cell()->forgotten() + klipper.cell()->readings().size();
  });
  return taps ? AddDump(connection, "taps", params, next, {"probe_tap_event"})
              : AddDump(connection, "force", params, next,
                        {"time", "force (g)", "counts", "tare_counts"});
}

void Hub::CellTick(const VirtualKlipper& klipper) {
  if (klipper.cell() == nullptr) return;
  for (Dump& dump : dumps_) {
    if (dump.source == "force") SendForce(klipper, dump);
    if (dump.source == "taps") SendTaps(klipper, dump);
  }
}

void Hub::SendForce(const VirtualKlipper& klipper, Dump& dump) {
  const CellProbe& cell = *klipper.cell();
  Json data = Json::array();
  for (; dump.next < cell.forgotten() + cell.readings().size(); ++dump.next) {
    if (dump.next < cell.forgotten()) continue;
    const ForceReading& reading = cell.readings()[dump.next - cell.forgotten()];
    data.push_back({reading.time_s, reading.force_g, reading.counts, reading.tare_counts});
  }
  if (!data.empty()) SendDump(dump, {{"data", data}, {"errors", 0}, {"overflows", 0}});
}

void Hub::SendTaps(const VirtualKlipper& klipper, Dump& dump) {
  const std::vector<ProbedTap>& taps = klipper.history().taps;
  for (; dump.next < taps.size(); ++dump.next) {
    const ProbedTap& tap = taps[dump.next];
    Json told = {{"time", tap.time_s}, {"force", tap.force_g}, {"is_valid", true}};
    if (klipper.config().load_cell->pulls_back) told["moves"] = MovesOf(tap);
    SendDump(dump, {{"tap", told}});
  }
}

}  // namespace trammel::sim
