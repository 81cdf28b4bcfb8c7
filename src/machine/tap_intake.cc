#include "machine/tap_intake.h"

#include <nlohmann/json.hpp>

#include "machine/json_field.h"

namespace trammel::machine {

using nlohmann::json;

std::optional<LoadCellName> FirstLoadCell(const json& objects) {
  std::optional<LoadCellName> found;
  if (!objects.is_array()) return found;
  for (const json& object : objects) {
    if (!object.is_string()) continue;
    const auto& name = object.get_ref<const std::string&>();
    const bool probe = name == "load_cell_probe" || name.starts_with("load_cell_probe ");
    const bool cell = name == "load_cell" || name.starts_with("load_cell ");
    if (!probe && !(cell && !found)) continue;
    const std::size_t blank = name.rfind(' ');
    found = LoadCellName{blank == std::string::npos ? name : name.substr(blank + 1), probe};
    if (probe) break;
  }
  return found;
}

void TapIntake::TakeTap(const json& params, double received_s) {
  const json* tap = Member(params, "tap");
  const json* moves = tap == nullptr ? nullptr : Member(*tap, "moves");
  // Klipper itself sends no moves, and no pull-back either: such taps are built of its streams.
  if (moves == nullptr || !moves->is_array() || moves->empty()) return;
  whole_taps_ = true;
  events_.on_tap(*tap, received_s);
}

void TapIntake::TakeForces(const json& batch, double received_s) {
  builder_.AddForces(batch);
  HandOnBuilt(received_s);
}

void TapIntake::TakeMoves(const json& batch, double received_s) {
  builder_.AddMoves(batch);
  HandOnBuilt(received_s);
}

void TapIntake::HandOnBuilt(double received_s) {
  for (const json& tap : builder_.Take()) {
    if (!whole_taps_) events_.on_tap(tap, received_s);
  }
}

void TapIntake::TakeStatus(const json& status, double received_s, bool first) {
  if (const auto temperature = Number(ObjectOr(status, "extruder"), "temperature")) {
    const std::lock_guard lock(mutex_);
    temperature_c_ = *temperature;
  }
  const auto z_mm = Number(ObjectOr(status, "probe"), "last_z_result");
  if (z_mm && !first) events_.on_firmware_z(*z_mm, received_s);
}

void TapIntake::TakeLine(const std::string& line, double received_s) {
  if (const auto z_mm = ProbeResult(line)) events_.on_firmware_z(*z_mm, received_s);
  // Klipper calls a script with an unknown command a success, and only says it here.
  const std::size_t name = line.find("TRAMMEL_TAP");
  if (line.find("Unknown command:\"TRAMMEL_TAP") != std::string::npos) {
    Tell("the printer does not know " + line.substr(name, line.find('"', name) - name) +
         "; include klipper/trammel.cfg in its configuration");
  }
}

void TapIntake::TakeCall(const json& arguments, double received_s) const {
  events_.on_call(arguments, received_s);
}

std::optional<double> TapIntake::temperature_c() const {
  const std::lock_guard lock(mutex_);
  return temperature_c_;
}

}  // namespace trammel::machine
