#include "machine/moonraker/printer_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "machine/net/json_field.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSections = 2000;
constexpr std::size_t kLongestName = 100;
constexpr std::string_view kDualCarriage = "dual_carriage";

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// A name that may stand in G-code and in a message.
bool IsPlainName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c >= 0x20 && c < 0x7F && c != ';' && c != '"'; });
}

std::string NameIn(const json& section, const char* key) {
  const std::string name = TextOr(section, key, "");
  return IsPlainName(name) ? name : std::string();
}

/// Positive, and of a size that some printer may have.
std::optional<double> Size(const json& section, const char* key) {
  constexpr double kMost = 1e8;
  const auto number = Number(section, key);
  return number && *number > 0 && *number <= kMost ? number : std::nullopt;
}

void ReadExtruder(const json& section, PrinterFacts& facts) {
  facts.nozzle_diameter_mm = Size(section, "nozzle_diameter");
  facts.filament_diameter_mm = Size(section, "filament_diameter");
  facts.min_extrude_temp_c = Number(section, "min_extrude_temp");
  facts.nozzle_max_c = Number(section, "max_temp");
  facts.max_extrude_cross_section_mm2 = Size(section, "max_extrude_cross_section");
  facts.max_extrude_only_distance_mm = Size(section, "max_extrude_only_distance");
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

/// An extruder's own motor states no queue as long as it was not synchronised with any.
void ReadMotors(const PrinterState& state, PrinterFacts& facts) {
  const auto own = state.pressure_advance.find(facts.extruder);
  const bool has_own = own != state.pressure_advance.end();
  facts.no_pressure_advance = !has_own && state.heaters.contains(facts.extruder);
  if (has_own && (own->second.motion_queue.empty() || own->second.motion_queue == facts.extruder)) {
    facts.advance_motors.push_back(facts.extruder);
  }
  for (const auto& [section, motor] : state.pressure_advance) {
    if (section != facts.extruder && motor.motion_queue == facts.extruder) {
      facts.advance_motors.push_back(section);
    }
  }
}

}  // namespace

bool Reach::Contains(double x_mm, double y_mm) const {
  if (x_mm < minimum_mm[0] || x_mm > maximum_mm[0] || y_mm < minimum_mm[1] ||
      y_mm > maximum_mm[1]) {
    return false;
  }
  if (!round) return true;
  constexpr double kSlack = 1e-9;  // of a point on the circle
  const auto out = [this](double at_mm, std::size_t axis) {
    const double half_mm = (maximum_mm[axis] - minimum_mm[axis]) / 2;
    return half_mm > 0 ? (at_mm - minimum_mm[axis] - half_mm) / half_mm : 0;
  };
  return std::hypot(out(x_mm, 0), out(y_mm, 1)) <= 1 + kSlack;
}

std::string Reach::Describe() const {
  return fmt::format("X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm{}", minimum_mm[0], maximum_mm[0],
                     minimum_mm[1], maximum_mm[1], round ? " in a circle" : "");
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
  facts.reach = {state.axis_minimum_mm, state.axis_maximum_mm};
  facts.max_velocity_mm_s = state.limits.max_velocity_mm_s;
  facts.max_accel_mm_s2 = state.limits.max_accel_mm_s2;
  facts.extruder = !extruder.empty()               ? extruder
                   : state.active_extruder.empty() ? "extruder"
                                                   : state.active_extruder;
  const json& settings = ObjectOr(ObjectOr(status, "configfile"), "settings");
  for (const auto& [name, section] : settings.items()) {
    if (facts.sections.size() >= kMostSections) break;
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
  facts.bed_max_c = Number(ObjectOr(settings, "heater_bed"), "max_temp");
  ReadExtruder(ObjectOr(settings, facts.extruder), facts);
  ReadMotors(state, facts);
  return facts;
}

}  // namespace trammel::machine
