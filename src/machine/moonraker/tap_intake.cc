#include "machine/moonraker/tap_intake.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "machine/net/json_field.h"

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

void TapIntake::Restart() {
  builder_.Reset();
  held_.clear();
  missed_moves_ = false;
  source_ = Source::kBuilder;
}

bool TapIntake::MissesMoves() {
  const bool missing = source_ != Source::kPrinter && builder_.MovesStayAway() && !missed_moves_;
  if (!missing) return false;
  missed_moves_ = true;
  Tell("the printer's moves stay away; asking for them once more");
  return true;
}

void TapIntake::TakeTap(const json& params, double received_s) {
  const json* tap = Member(params, "tap");
  if (tap == nullptr) return;
  const json* moves = Member(*tap, "moves");
  // Klipper itself sends no moves, and as soon as the nozzle has stopped: such a tap goes on with
  // the rise and is built of its streams.
  const bool whole = moves != nullptr && moves->is_array() && !moves->empty();
  source_ = whole ? Source::kPrinter : Source::kBuilder;
  if (whole) held_.clear();
  if (!whole || *tap == last_whole_) return;
  last_whole_ = *tap;
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
  for (json& tap : builder_.Take()) {
    if (source_ != Source::kPrinter) held_.push_back(std::move(tap));
  }
  // Before the first word of dump_taps the printer may be one that tells this tap itself.
  constexpr double kToldWithin_s = 1;
  if (held_.empty() ||
      (source_ == Source::kUnknown &&
       builder_.forces_until_s() < held_.back()["time"].back().get<double>() + kToldWithin_s)) {
    return;
  }
  source_ = Source::kBuilder;
  for (const json& tap : std::exchange(held_, {})) events_.on_tap(tap, received_s);
}

void TapIntake::TakeStatus(const json& status, double received_s, bool first) {
  if (const auto temperature = Number(ObjectOr(status, "extruder"), "temperature")) {
    const std::lock_guard lock(mutex_);
    temperature_c_ = *temperature;
  }
  const json& probe = ObjectOr(status, "probe");
  if (first) by_position_ = !probe.contains("last_z_result");
  std::optional<double> z_mm = Number(probe, "last_z_result");
  // Klipper removes it in favour of the place on the bed, which is less the probe's offset.
  const json* const place = by_position_ ? Member(probe, "last_probe_position") : nullptr;
  constexpr std::size_t kZ = 2;
  if (place != nullptr && place->is_array() && place->size() > kZ && (*place)[kZ].is_number()) {
    z_mm = (*place)[kZ].get<double>() + z_offset_mm_;
  }
  if (z_mm && !first) events_.on_firmware_z(*z_mm, received_s);
}

void TapIntake::TakeSettings(const json& status) {
  const json& settings = ObjectOr(ObjectOr(status, "configfile"), "settings");
  constexpr double kMost_mm = 1000;
  z_offset_mm_ = 0;
  for (const auto& [section, values] : settings.items()) {
    if (section != "load_cell_probe" && !section.starts_with("load_cell_probe ")) continue;
    const double z_mm = NumberOr(values, "z_offset", 0);
    if (std::abs(z_mm) <= kMost_mm) z_offset_mm_ = z_mm;
  }
}

void TapIntake::TakeLine(const std::string& line, double received_s) {
  if (const auto result = ProbeResult(line)) {
    // The status and older firmware tell where the nozzle was triggered.
    const double z_mm = result->less_offset ? result->z_mm + z_offset_mm_ : result->z_mm;
    events_.on_firmware_z(z_mm, received_s);
  }
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
