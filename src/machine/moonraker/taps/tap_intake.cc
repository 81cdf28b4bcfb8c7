#include "machine/moonraker/taps/tap_intake.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "machine/moonraker/client/move_log.h"
#include "machine/net/json_field.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr double kAlongZ = 0.99;   // minimum z component of a direction along z
constexpr double kGap_s = 1e-3;    // moves of one rise follow each other without more
constexpr double kMaxRise_mm = 1;  // more is a lift, or what homing does
constexpr double kMinRise_mm = 0.005;
constexpr double kLongestHalt_s = 5;  // between descent and rise
constexpr double kBefore_s = 3;       // recorded part of the descent
constexpr double kAfter_s = 0.25;     // of the rest after the rise that is kept
/// dump_trapq sends every 0.5 s, so a move that begins now is known by then.
constexpr double kMovesLate_s = 0.6;
constexpr double kMovesSilent_s = 3;
constexpr double kKept_s = 60;
constexpr double kMaxTime_s = 1e9;  // print time counts from the board's start
/// Forces that step back by more come from a restarted clock.
constexpr double kLongestRepeat_s = 2;
constexpr std::size_t kMaxSamples = 200'000;
constexpr std::size_t kMaxMoves = 20'000;

double End(const TrapezoidMove& move) { return move.print_time_s + move.duration_s; }

double Rise(const TrapezoidMove& move) {
  const double speed = move.start_velocity_mm_s + move.acceleration_mm_s2 * move.duration_s / 2;
  return move.direction[2] * speed * move.duration_s;
}

json ToJson(const TrapezoidMove& move) {
  return {{"print_time", move.print_time_s},
          {"move_t", move.duration_s},
          {"start_v", move.start_velocity_mm_s},
          {"accel", move.acceleration_mm_s2},
          {"start_x", move.start_mm[0]},
          {"start_y", move.start_mm[1]},
          {"start_z", move.start_mm[2]},
          {"x_r", move.direction[0]},
          {"y_r", move.direction[1]},
          {"z_r", move.direction[2]}};
}

}  // namespace

void TapBuilder::AddForces(const json& batch) {
  const json* data = Member(batch, "data");
  if (data == nullptr || !data->is_array()) return;
  for (const json& row : *data) {
    if (!row.is_array() || row.size() < 2 || !row[0].is_number() || !row[1].is_number()) continue;
    const Sample sample{row[0].get<double>(), row[1].get<double>()};
    if (!(std::abs(sample.time_s) < kMaxTime_s)) continue;
    if (!samples_.empty() && sample.time_s < samples_.back().time_s - kLongestRepeat_s) Reset();
    if (!samples_.empty() && sample.time_s <= samples_.back().time_s) continue;
    samples_.push_back(sample);
  }
  Forget();
}

void TapBuilder::AddMoves(const json& batch) {
  MoveLog log;
  log.Add(batch);
  for (const TrapezoidMove& move : log.Overlapping(-1e300, 1e300)) Insert(move);
  Forget();
}

void TapBuilder::Insert(const TrapezoidMove& move) {
  if (!(std::abs(move.print_time_s) < kMaxTime_s) || !(move.duration_s < kMaxTime_s)) return;
  auto at = std::upper_bound(
      moves_.begin(), moves_.end(), move.print_time_s,
      [](double time_s, const TrapezoidMove& known) { return time_s < known.print_time_s; });
  // A marker may have the same time as the beginning of a move.
  const bool marker = move.duration_s == 0;
  for (auto known = at; known != moves_.begin();) {
    --known;
    if (known->print_time_s != move.print_time_s) break;
    if ((known->duration_s == 0) != marker) continue;
    *known = move;
    return;
  }
  moves_.insert(at, move);
}

void TapBuilder::Reset() { *this = TapBuilder(); }

void TapBuilder::Forget() {
  while (!samples_.empty() && (samples_.size() > kMaxSamples ||
                               samples_.front().time_s < samples_.back().time_s - kKept_s)) {
    samples_.pop_front();
  }
  while (moves_.size() > kMaxMoves ||
         (!moves_.empty() && End(moves_.front()) < moves_.back().print_time_s - kKept_s)) {
    moves_.pop_front();
  }
}

bool TapBuilder::FindRise(std::size_t from, Found& found) const {
  for (std::size_t i = from; i < moves_.size(); ++i) {
    if (!(moves_[i].direction[2] > kAlongZ) || moves_[i].print_time_s <= taken_until_s_) continue;
    std::size_t end = i + 1;
    double rise_mm = Rise(moves_[i]);
    while (end < moves_.size() && moves_[end].direction[2] > kAlongZ &&
           moves_[end].print_time_s - End(moves_[end - 1]) < kGap_s) {
      rise_mm += Rise(moves_[end++]);
    }
    // Markers of zero duration are between the descent and the rise.
    std::size_t down = i;
    while (down > 0 && moves_[down - 1].duration_s == 0) --down;
    const bool descended = down > 0 && moves_[down - 1].direction[2] < -kAlongZ &&
                           moves_[i].print_time_s - End(moves_[down - 1]) < kLongestHalt_s;
    if (descended && rise_mm >= kMinRise_mm && rise_mm <= kMaxRise_mm) {
      std::size_t first = down - 1;
      while (first > 0 && moves_[first - 1].direction[2] < -kAlongZ && i - first < 8) --first;
      found = {first, i, end};
      return true;
    }
    i = end - 1;
  }
  return false;
}

bool TapBuilder::Complete(const Found& found, double& until_s) const {
  if (samples_.empty()) return false;
  const double end_s = End(moves_[found.end - 1]);
  until_s = end_s + kAfter_s;
  const bool more_known = found.end < moves_.size();
  if (more_known) until_s = std::max(end_s, std::min(until_s, moves_[found.end].print_time_s));
  // The rise may continue in the next batch.
  return samples_.back().time_s >= (more_known ? until_s : end_s + kMovesLate_s);
}

json TapBuilder::Cut(const Found& found, double until_s) const {
  json tap = {{"time", json::array()},
              {"force", json::array()},
              {"moves", json::array()},
              {"x_rise_print_time_s", moves_[found.rise].print_time_s}};
  const double from_s =
      std::max(moves_[found.first].print_time_s, moves_[found.rise].print_time_s - kBefore_s);
  for (const Sample& sample : samples_) {
    if (sample.time_s < from_s || sample.time_s > until_s) continue;
    tap["time"].push_back(sample.time_s);
    tap["force"].push_back(sample.force_g);
  }
  for (std::size_t i = found.first; i < found.end; ++i) tap["moves"].push_back(ToJson(moves_[i]));
  return tap;
}

double TapBuilder::forces_until_s() const {
  return samples_.empty() ? -HUGE_VAL : samples_.back().time_s;
}

bool TapBuilder::MovesStayAway() const {
  return !samples_.empty() &&
         (moves_.empty() || End(moves_.back()) < forces_until_s() - kMovesSilent_s);
}

std::vector<json> TapBuilder::Take() {
  std::vector<json> taps;
  Found found;
  std::size_t from = 0;
  double until_s = 0;
  while (FindRise(from, found) && Complete(found, until_s)) {
    // Moves reach back before the subscription, forces do not.
    if (samples_.front().time_s < moves_[found.rise].print_time_s) {
      taps.push_back(Cut(found, until_s));
    }
    taken_until_s_ = moves_[found.end - 1].print_time_s;
    from = found.end;
  }
  return taps;
}

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
  Notify("the printer's moves stay away; asking for them once more");
  return true;
}

void TapIntake::TakeTap(const json& params, double received_s) {
  const json* tap = Member(params, "tap");
  if (tap == nullptr) return;
  const json* moves = Member(*tap, "moves");
  // Klipper itself sends taps without moves, as soon as the nozzle has stopped: such a tap is
  // completed by the rise and built from its streams.
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
  // Before dump_taps' first message the printer may be one that sends this tap itself.
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
  // Klipper replaces it by the position on the bed, which has the probe's offset subtracted.
  const json* const place = by_position_ ? Member(probe, "last_probe_position") : nullptr;
  constexpr std::size_t kZ = 2;
  if (place != nullptr && place->is_array() && place->size() > kZ && (*place)[kZ].is_number()) {
    z_mm = (*place)[kZ].get<double>() + z_offset_mm_;
  }
  if (z_mm && !first) events_.on_firmware_z(*z_mm, received_s);
}

void TapIntake::TakeSettings(const json& status) {
  const json& settings = ObjectOr(ObjectOr(status, "configfile"), "settings");
  constexpr double kMax_mm = 1000;
  z_offset_mm_ = 0;
  for (const auto& [section, values] : settings.items()) {
    if (section != "load_cell_probe" && !section.starts_with("load_cell_probe ")) continue;
    const double z_mm = NumberOr(values, "z_offset", 0);
    if (std::abs(z_mm) <= kMax_mm) z_offset_mm_ = z_mm;
  }
}

void TapIntake::TakeLine(const std::string& line, double received_s) {
  if (const auto result = ProbeResult(line)) {
    // The status and older firmware report the nozzle's trigger position.
    const double z_mm = result->less_offset ? result->z_mm + z_offset_mm_ : result->z_mm;
    events_.on_firmware_z(z_mm, received_s);
  }
  // Klipper reports success for a script with an unknown command, and mentions it only here.
  const std::size_t name = line.find("TRAMMEL_TAP");
  if (line.find("Unknown command:\"TRAMMEL_TAP") != std::string::npos) {
    Notify("the printer does not know " + line.substr(name, line.find('"', name) - name) +
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
