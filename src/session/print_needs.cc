#include "session/print_needs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "settings/material.h"

namespace trammel::procedure {
namespace {

using machine::PrinterFacts;

constexpr double kAsk_s = 10;
constexpr double kRounding = 1e-6;  // of numbers that went through a text

// What is in force, and how it comes back where somebody lowered it since Klipper started.
struct Limit {
  const char* name;       // in [printer]
  const char* parameter;  // of SET_VELOCITY_LIMIT
  const char* unit;
  double in_force = 0;
  double configured = 0;
};

std::optional<std::string> FindBeyond(const Limit& limit, double needed, const PrintNeeds& needs) {
  const double most =
      needs.printed_before ? std::max(limit.in_force, limit.configured) : limit.in_force;
  if (most <= 0 || needed <= most * (1 + kRounding)) return std::nullopt;
  const bool lowered = limit.configured >= needed * (1 - kRounding);
  return fmt::format(
      "the printer's {} is {:g} {}, and the pattern {} at {:g} {}: its lines would not be as "
      "planned; {}",
      limit.name, most, limit.unit, needs.printed_before ? "is planned" : "prints", needed,
      limit.unit,
      lowered ? fmt::format("somebody lowered it: SET_VELOCITY_LIMIT {}={:g} sets it as in "
                            "printer.cfg",
                            limit.parameter, limit.configured)
              : fmt::format("raise {} of [printer] in printer.cfg, or ask for less ({})",
                            limit.name, needs.motion_settings));
}

Check CompareLimits(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "limits";
  for (const NeededMotion& motion : needs.motions) {
    const Limit speed{"max_velocity", "VELOCITY", "mm/s", facts.max_velocity_mm_s,
                      facts.configured_max_velocity_mm_s};
    const Limit acceleration{"max_accel", "ACCEL", "mm/s2", facts.max_accel_mm_s2,
                             facts.configured_max_accel_mm_s2};
    auto beyond = FindBeyond(speed, motion.speed_mm_s, needs);
    if (!beyond) {
      beyond = FindBeyond(acceleration, motion.acceleration_mm_s2, needs);
      // As long a way to full speed, so that as much of each line is steady.
      if (beyond && motion.speed_mm_s > 0) {
        *beyond += fmt::format(
            "; {:g} mm/s2 go with {:.0f} mm/s instead of {:g}", facts.max_accel_mm_s2,
            motion.speed_mm_s * std::sqrt(facts.max_accel_mm_s2 / motion.acceleration_mm_s2),
            motion.speed_mm_s);
      }
    }
    if (beyond) return Unsafe(kName, std::move(*beyond));
  }
  if (facts.max_velocity_mm_s <= 0) return Pass(kName, "the printer states none");
  return Pass(kName, fmt::format("the printer allows {:g} mm/s and {:g} mm/s2",
                                 facts.max_velocity_mm_s, facts.max_accel_mm_s2));
}

Check CompareFilament(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "filament";
  constexpr double kMeasured_mm =
      0.1;  // by which a caliper's value may differ from the nominal one
  const double ours_mm = needs.filament_diameter_mm;
  if (!facts.filament_diameter_mm || ours_mm <= 0) return Pass(kName, "its diameter is not stated");
  const double theirs_mm = *facts.filament_diameter_mm;
  if (std::abs(theirs_mm - ours_mm) <= kMeasured_mm) {
    return Pass(kName, fmt::format("{:g} mm", theirs_mm));
  }
  return Unsafe(kName,
                fmt::format("filament_diameter of [{}] in printer.cfg is {:g} mm, and {:g} mm is "
                            "printed with: {:.2f} times as much filament as planned; set "
                            "filament_diameter = {:g} in [filament], or correct printer.cfg",
                            facts.extruder, theirs_mm, ours_mm,
                            theirs_mm * theirs_mm / (ours_mm * ours_mm), theirs_mm));
}

Check CompareNozzle(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "nozzle";
  constexpr double kSame_mm = 0.01;
  const double ours_mm = needs.nozzle_diameter_mm;
  if (!facts.nozzle_diameter_mm || ours_mm <= 0) return Pass(kName, "its diameter is not stated");
  const double theirs_mm = *facts.nozzle_diameter_mm;
  if (std::abs(theirs_mm - ours_mm) > kSame_mm) {
    return Unsafe(kName, fmt::format("nozzle_diameter of [{}] in printer.cfg is {:g} mm, and {:g} "
                                     "mm is printed with: set nozzle_diameter = {:g} in [printer], "
                                     "or correct printer.cfg",
                                     facts.extruder, theirs_mm, ours_mm, theirs_mm));
  }
  return Pass(kName, fmt::format("{:g} mm", theirs_mm));
}

// What Klipper would refuse in the middle of the print.
std::optional<Check> FindTooMuch(const PrinterFacts& facts, const PrintNeeds& needs) {
  if (facts.max_extrude_cross_section_mm2 &&
      needs.bead_mm2 > *facts.max_extrude_cross_section_mm2) {
    return Unsafe(
        "bead", fmt::format("a bead has {:.3g} mm2, and max_extrude_cross_section of "
                            "[{}] in printer.cfg is {:.3g} mm2: raise it, or set a "
                            "smaller line_width or layer_height",
                            needs.bead_mm2, facts.extruder, *facts.max_extrude_cross_section_mm2));
  }
  if (facts.max_extrude_only_distance_mm &&
      needs.pushed_alone_mm > *facts.max_extrude_only_distance_mm) {
    return Unsafe("retract", fmt::format("{:g} mm of filament are moved at once, and "
                                         "max_extrude_only_distance of [{}] in printer.cfg is {:g} "
                                         "mm: raise it, or set a smaller retract_length or "
                                         "prime_length",
                                         needs.pushed_alone_mm, facts.extruder,
                                         *facts.max_extrude_only_distance_mm));
  }
  return std::nullopt;
}

Check CompareShape(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "bed shape";
  const bool round = facts.shape() == machine::ReachShape::kEllipse;
  if (round && needs.rectangular_bed) {
    return Unsafe(kName, fmt::format("kinematics is {} in printer.cfg, so that the nozzle reaches "
                                     "a circle, and bed_shape is \"rectangle\": set bed_shape = "
                                     "\"ellipse\" in [printer]",
                                     facts.kinematics));
  }
  if (facts.kinematics.empty()) return Pass(kName, "the printer states no kinematics");
  return Pass(kName,
              fmt::format("bed_shape = \"{}\", kinematics {}",
                          needs.rectangular_bed ? "rectangle" : "ellipse", facts.kinematics));
}

}  // namespace

Result<PrinterFacts> ReadFacts(const Session& session, const std::string& extruder) {
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  const auto status = session.printer.Query({{"configfile", {"settings"}}}, session.Within(kAsk_s));
  if (!status) return tl::unexpected(status.error());
  return machine::FactsOf(*status, *state, extruder);
}

std::vector<Check> CompareFacts(const PrinterFacts& facts, const PrintNeeds& needs) {
  std::vector<Check> checks;
  if (!needs.motions.empty()) checks.push_back(CompareLimits(facts, needs));
  if (needs.filament_diameter_mm > 0) checks.push_back(CompareFilament(facts, needs));
  if (needs.nozzle_diameter_mm > 0) checks.push_back(CompareNozzle(facts, needs));
  if (auto much = FindTooMuch(facts, needs)) checks.push_back(std::move(*much));
  checks.push_back(CompareShape(facts, needs));
  if (needs.sets_pressure_advance) {
    checks.push_back(ComparePressureAdvance(facts, needs.advance_motors));
  }
  return checks;
}

Check ComparePressureAdvance(const PrinterFacts& facts, const std::vector<std::string>& motors) {
  constexpr const char* kName = "pressure advance";
  if (!facts.pressure_advance_model.empty()) {
    return Unsafe(kName,
                  fmt::format("pressure_advance_model of [{}] in printer.cfg is {}, which has no "
                              "pressure advance in seconds that could be measured or set; nothing "
                              "was changed: set pressure_advance_model: linear and restart",
                              facts.extruder, facts.pressure_advance_model));
  }
  if (facts.no_pressure_advance) {
    return Unsafe(kName, fmt::format("the printer reports no pressure advance of {}: [{}] in "
                                     "printer.cfg has no stepper of its own, and Klipper refuses "
                                     "SET_PRESSURE_ADVANCE for it; give it its motor there",
                                     facts.extruder, facts.extruder));
  }
  if (motors != facts.advance_names()) {
    return Unsafe(kName,
                  fmt::format("{} push{} the filament, and the print would not set the "
                              "pressure advance there: print the pattern with trammel pa "
                              "print or pa calibrate without a file of its own",
                              AdvanceSections(facts), facts.advance_motors.size() > 1 ? "" : "es"));
  }
  return Pass(kName, "acts on " + AdvanceSections(facts));
}

Check CompareTemperatures(const PrinterFacts& facts, const settings::FilamentSettings& filament) {
  constexpr const char* kName = "temperatures";
  if (const auto problem = settings::FindTemperatureProblem(filament)) {
    Check check = Miss(kName, fmt::format("nothing can be printed: [{}] {}: {}", problem->section,
                                          problem->key, problem->message));
    check.advice = true;
    return check;
  }
  const auto asked = settings::TemperaturesOf(filament);
  const std::string shown = settings::DescribeTemperatures(filament);
  const auto refuse = [&](const char* key, double asked_c, const char* bound, double bound_c) {
    return Unsafe(
        kName, fmt::format("{}: [filament] {} = {:.4g} degC is {} this printer's {} = {:.4g} degC; "
                           "name the material that is loaded, or set {}",
                           shown, key, asked_c,
                           std::string_view(bound).starts_with("min") ? "below" : "above", bound,
                           bound_c, key));
  };
  if (facts.min_extrude_temp_c && asked.nozzle_c < *facts.min_extrude_temp_c) {
    return refuse("nozzle_temperature", asked.nozzle_c, "min_extrude_temp",
                  *facts.min_extrude_temp_c);
  }
  for (const auto& [key, asked_c] : {std::pair{"nozzle_temperature", asked.nozzle_c},
                                     std::pair{"idle_nozzle_temperature", asked.idle_nozzle_c}}) {
    if (facts.nozzle_max_c && asked_c > *facts.nozzle_max_c) {
      return refuse(key, asked_c, "max_temp of the extruder", *facts.nozzle_max_c);
    }
  }
  if (facts.bed_max_c && asked.bed_c > *facts.bed_max_c) {
    return refuse("bed_temperature", asked.bed_c, "max_temp of the bed", *facts.bed_max_c);
  }
  return Pass(kName, shown);
}

std::string AdvanceSections(const PrinterFacts& facts) {
  if (facts.advance_motors.empty()) return facts.extruder;
  return fmt::format("{}", fmt::join(facts.advance_motors, " and "));
}

}  // namespace trammel::procedure
