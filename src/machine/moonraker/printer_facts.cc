#include "machine/moonraker/printer_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/text.h"
#include "machine/net/json_field.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxSections = 2000;
constexpr std::size_t kLongestName = 100;
constexpr std::string_view kDualCarriage = "dual_carriage";

/// True if a name is safe in G-code and in a message.
bool IsPlainName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c >= 0x20 && c < 0x7F && c != ';' && c != '"'; });
}

std::string NameIn(const json& section, const char* key) {
  const std::string name = TextOr(section, key, "");
  return IsPlainName(name) ? name : std::string();
}

/// Returns a positive number of plausible size.
std::optional<double> Size(const json& section, const char* key) {
  constexpr double kMax = 1e8;
  const auto number = Number(section, key);
  return number && *number > 0 && *number <= kMax ? number : std::nullopt;
}

void ReadExtruder(const json& section, PrinterFacts& facts) {
  for (const char* key : {"nozzle_diameter", "filament_diameter"}) {
    if (Member(section, key) != nullptr && !Size(section, key)) facts.unreadable = key;
  }
  facts.nozzle_diameter_mm = Size(section, "nozzle_diameter");
  facts.filament_diameter_mm = Size(section, "filament_diameter");
  facts.min_extrude_temp_c = Number(section, "min_extrude_temp");
  facts.nozzle_max_c = Number(section, "max_temp");
  facts.max_extrude_cross_section_mm2 = Size(section, "max_extrude_cross_section");
  const auto distance_mm = Number(section, "max_extrude_only_distance");  // 0: none at all
  if (distance_mm && *distance_mm >= 0) facts.max_extrude_only_distance_mm = distance_mm;
  facts.max_extrude_only_velocity_mm_s = Size(section, "max_extrude_only_velocity");
  facts.max_extrude_only_accel_mm_s2 = Size(section, "max_extrude_only_accel");
  const auto corner_mm_s = Number(section, "instantaneous_corner_velocity");
  if (corner_mm_s && *corner_mm_s >= 0) facts.instantaneous_corner_velocity_mm_s = corner_mm_s;
  const std::string model = NameIn(section, "pressure_advance_model");
  if (LowerCase(model) != "linear") facts.pressure_advance_model = model;
}

void ReadCarriages(const std::string& name, const json& section, PrinterFacts& facts) {
  if (!name.starts_with(kDualCarriage)) return;
  if (name == kDualCarriage) facts.dual_carriages.push_back({});
  if (name.size() <= kDualCarriage.size() + 1 || name[kDualCarriage.size()] != ' ') return;
  facts.dual_carriages.push_back(
      {NameIn(section, "primary_carriage"), name.substr(kDualCarriage.size() + 1)});
}

/// An extruder's own motor states no queue until it was synchronised with one.
void ReadMotors(const PrinterState& state, PrinterFacts& facts) {
  const auto own = state.pressure_advance.find(facts.extruder);
  const bool has_own = own != state.pressure_advance.end();
  facts.no_pressure_advance = !has_own && state.heaters.contains(facts.extruder);
  if (has_own && !own->second.motion_queue.empty() && own->second.motion_queue != facts.extruder) {
    facts.pushes_for = own->second.motion_queue;
  }
  if (has_own && (own->second.motion_queue.empty() || own->second.motion_queue == facts.extruder)) {
    facts.advance_motors.push_back(facts.extruder);
  }
  for (const auto& [section, motor] : state.pressure_advance) {
    if (section != facts.extruder && motor.motion_queue == facts.extruder) {
      facts.advance_motors.push_back(section);
    }
  }
  for (const std::string& section : facts.advance_motors) {
    const auto& smooth_s = state.pressure_advance.at(section).smooth_time_s;
    if (smooth_s) facts.smooth_times_s[section] = *smooth_s;
  }
}

/// A G-code offset is the active tool's: others have their own.
void ReadReach(const PrinterState& state, bool active, PrinterFacts& facts) {
  facts.reach = {state.axis_minimum_mm, state.axis_maximum_mm};
  if (!active) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double offset_mm = state.gcode.homing_origin_mm[axis];
    facts.reach.offset_mm[axis] = offset_mm;
    facts.reach.minimum_mm[axis] -= offset_mm;
    facts.reach.maximum_mm[axis] -= offset_mm;
  }
}

}  // namespace

bool Reach::Contains(double x_mm, double y_mm) const {
  if (x_mm < minimum_mm[0] || x_mm > maximum_mm[0] || y_mm < minimum_mm[1] ||
      y_mm > maximum_mm[1]) {
    return false;
  }
  if (!round) return true;
  constexpr double kSlack = 1e-9;  // tolerance for points on the circle
  const auto out = [this](double at_mm, std::size_t axis) {
    const double half_mm = (maximum_mm[axis] - minimum_mm[axis]) / 2;
    return half_mm > 0 ? (at_mm - minimum_mm[axis] - half_mm) / half_mm : 0;
  };
  return std::hypot(out(x_mm, 0), out(y_mm, 1)) <= 1 + kSlack;
}

std::string Reach::Describe() const {
  const bool moved = std::ranges::any_of(offset_mm, [](double axis_mm) { return axis_mm != 0; });
  return fmt::format("X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm{}{}", minimum_mm[0],
                     maximum_mm[0], minimum_mm[1], maximum_mm[1], round ? " in a circle" : "",
                     moved ? fmt::format(" (with the G-code offset {:g}, {:g}, {:g} mm)",
                                         offset_mm[0], offset_mm[1], offset_mm[2])
                           : "");
}

ReachShape PrinterFacts::shape() const {
  for (const char* known : {"cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz",
                            "generic_cartesian", "deltesian", "limited_cartesian", "limited_corexy",
                            "limited_corexz", "ratos_hybrid_corexy"}) {
    if (kinematics == known) return ReachShape::kRectangle;
  }
  for (const char* known : {"delta", "rotary_delta", "polar"}) {
    if (kinematics == known) return ReachShape::kEllipse;
  }
  return ReachShape::kUnknown;
}

std::vector<std::string> PrinterFacts::advance_names() const {
  if (advance_motors.empty() || advance_motors == std::vector{extruder}) return {};
  std::vector<std::string> names;
  for (const std::string& section : advance_motors) names.push_back(NameInGcode(section));
  return names;
}

PrinterFacts FactsOf(const json& status, const PrinterState& state, const std::string& extruder) {
  PrinterFacts facts;
  facts.max_velocity_mm_s = state.limits.max_velocity_mm_s;
  facts.max_accel_mm_s2 = state.limits.max_accel_mm_s2;
  facts.extruder = !extruder.empty()               ? extruder
                   : state.active_extruder.empty() ? "extruder"
                                                   : state.active_extruder;
  ReadReach(state, extruder.empty() || extruder == state.active_extruder, facts);
  const json& settings = ObjectOr(ObjectOr(status, "configfile"), "settings");
  for (const auto& [name, section] : settings.items()) {
    if (facts.sections.size() >= kMaxSections) break;
    if (!IsPlainName(name)) continue;
    const std::string lower = LowerCase(name);
    facts.sections.insert(lower);
    ReadCarriages(lower, section, facts);
  }
  const json& printer = ObjectOr(settings, "printer");
  facts.kinematics = NameIn(printer, "kinematics");
  facts.reach.round = !facts.kinematics.empty() && facts.shape() != ReachShape::kRectangle;
  facts.configured_max_velocity_mm_s = Size(printer, "max_velocity").value_or(0);
  facts.configured_max_accel_mm_s2 = Size(printer, "max_accel").value_or(0);
  if (facts.kinematics == "polar") {
    facts.max_angular_velocity_rad_s = Size(printer, "max_angular_velocity");
  }
  facts.bed_max_c = Number(ObjectOr(settings, "heater_bed"), "max_temp");
  facts.one_of_several =
      extruder.empty() && state.active_extruder.empty() && facts.sections.contains("extruder1");
  facts.configured = facts.sections.contains(facts.extruder);
  facts.no_bed_heater = facts.configured && !facts.sections.contains("heater_bed");
  ReadExtruder(ObjectOr(settings, facts.extruder), facts);
  ReadMotors(state, facts);
  return facts;
}

}  // namespace trammel::machine
