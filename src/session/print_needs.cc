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
constexpr double kRounding = 1e-6;  // tolerance for numbers printed as text

std::string NotStated(std::string_view name, std::string_view section) {
  return fmt::format(
      "the printer states no {} of [{}] that can be read, and every Klipper does: RESTART it and "
      "Moonraker",
      name, section);
}

// Limit in force, and its configured value, in case somebody lowered it since Klipper started.
struct Limit {
  const char* name;       // key in [printer]
  const char* parameter;  // in SET_VELOCITY_LIMIT
  const char* unit;
  double in_force = 0;
  double configured = 0;
};

std::optional<std::string> FindBeyond(const Limit& limit, double needed, const PrintNeeds& needs) {
  const double most = needs.printed_before ? std::max(limit.in_force, limit.configured)
                      : limit.in_force > 0 ? limit.in_force
                                           : limit.configured;
  if (most <= 0 && needed > 0 && !needs.printed_before) return NotStated(limit.name, "printer");
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

// Finds missing facts that a print requires and every Klipper states.
std::optional<Check> FindUnknown(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "printer.cfg";
  if (needs.printed_before) return std::nullopt;
  if (!facts.configured) {
    return Unsafe(kName, fmt::format("the printer states no [{}] of its configuration, so that "
                                     "nothing is known of nozzle and filament: RESTART it and "
                                     "Moonraker",
                                     facts.extruder));
  }
  if (facts.one_of_several) {
    return Unsafe(kName,
                  "the printer has several extruders and does not state which one is active: "
                  "RESTART it and Moonraker, or choose one (T0, ACTIVATE_EXTRUDER)");
  }
  if (!facts.unreadable.empty()) {
    return Unsafe(kName, NotStated(facts.unreadable, facts.extruder));
  }
  if (facts.kinematics.empty()) return Unsafe(kName, NotStated("kinematics", "printer"));
  return std::nullopt;
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
      // Same acceleration distance, so that as much of each line is steady.
      const double max_mm_s2 =
          acceleration.in_force > 0 ? acceleration.in_force : acceleration.configured;
      if (beyond && motion.speed_mm_s > 0 && max_mm_s2 > 0) {
        *beyond += fmt::format("; {:g} mm/s2 go with {:.0f} mm/s instead of {:g}", max_mm_s2,
                               motion.speed_mm_s * std::sqrt(max_mm_s2 / motion.acceleration_mm_s2),
                               motion.speed_mm_s);
      }
    }
    if (beyond) return Unsafe(kName, std::move(*beyond));
  }
  if (facts.max_velocity_mm_s <= 0) return Pass(kName, "the printer states none in force");
  return Pass(kName, fmt::format("the printer allows {:g} mm/s and {:g} mm/s2",
                                 facts.max_velocity_mm_s, facts.max_accel_mm_s2));
}

Check CompareFilament(const PrinterFacts& facts, const PrintNeeds& needs) {
  constexpr const char* kName = "filament";
  // Tolerance between a measured and the nominal diameter: that of filament on sale.
  constexpr double kMeasured_mm = 0.05;
  const double ours_mm = needs.filament_diameter_mm;
  if (!facts.filament_diameter_mm) return Pass(kName, "its diameter is not stated");
  const double theirs_mm = *facts.filament_diameter_mm;
  if (std::abs(theirs_mm - ours_mm) <= kMeasured_mm + kRounding) {
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
  if (!facts.nozzle_diameter_mm) return Pass(kName, "its diameter is not stated");
  const double theirs_mm = *facts.nozzle_diameter_mm;
  if (std::abs(theirs_mm - ours_mm) > kSame_mm + kRounding) {
    return Unsafe(kName, fmt::format("nozzle_diameter of [{}] in printer.cfg is {:g} mm, and {:g} "
                                     "mm is printed with: set nozzle_diameter = {:g} in [printer], "
                                     "or correct printer.cfg",
                                     facts.extruder, theirs_mm, ours_mm, theirs_mm));
  }
  return Pass(kName, fmt::format("{:g} mm", theirs_mm));
}

// Computes a bead's area as Klipper does: from the filament diameter of its own configuration.
double BeadOnPrinter_mm2(const PrinterFacts& facts, const PrintNeeds& needs) {
  if (!facts.filament_diameter_mm || needs.filament_diameter_mm <= 0) return needs.bead_mm2;
  const double wider = *facts.filament_diameter_mm / needs.filament_diameter_mm;
  return needs.bead_mm2 * wider * wider;
}

// Computes the duration of the longest motion of filament alone; 0 if unknown.
double MovesAlone_s(const PrinterFacts& facts, const PrintNeeds& needs) {
  if (needs.pushed_alone_mm <= 0 || needs.pushed_alone_mm_s <= 0) return 0;
  const double speed_mm_s =
      std::min(needs.pushed_alone_mm_s,
               facts.max_extrude_only_velocity_mm_s.value_or(needs.pushed_alone_mm_s));
  const double ramps_s =
      facts.max_extrude_only_accel_mm_s2 ? speed_mm_s / *facts.max_extrude_only_accel_mm_s2 : 0;
  const double cruise_s = needs.pushed_alone_mm / speed_mm_s - ramps_s;
  if (cruise_s >= 0) return cruise_s + 2 * ramps_s;
  return 2 * std::sqrt(needs.pushed_alone_mm / *facts.max_extrude_only_accel_mm_s2);
}

// Checks for moves that Klipper would refuse in mid-print, or slow down.
std::optional<Check> FindTooMuch(const PrinterFacts& facts, const PrintNeeds& needs) {
  const double bead_mm2 = BeadOnPrinter_mm2(facts, needs);
  if (facts.max_extrude_cross_section_mm2 && bead_mm2 > *facts.max_extrude_cross_section_mm2) {
    return Unsafe("bead",
                  fmt::format("a bead has {:.3g} mm2, and max_extrude_cross_section of [{}] in "
                              "printer.cfg is {:.3g} mm2: raise it, or set a smaller line_width or "
                              "layer_height",
                              bead_mm2, facts.extruder, *facts.max_extrude_cross_section_mm2));
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
  // A nozzle at rest for longer oozes a blob onto the line's start. Our choice: 60 times the
  // default retraction's time, and more than a Bowden tube's.
  constexpr double kLongest_s = 1;
  const double asked_s = MovesAlone_s({}, needs), alone_s = MovesAlone_s(facts, needs);
  if (alone_s > std::max(kLongest_s, 1.2 * asked_s)) {
    return Unsafe("retract",
                  fmt::format("{:g} mm of filament at {:g} mm/s would take {:.1f} s in place of "
                              "{:.2f} s, by max_extrude_only_velocity and max_extrude_only_accel "
                              "of [{}] in printer.cfg: raise them, or set a smaller retract_length "
                              "or prime_length",
                              needs.pushed_alone_mm, needs.pushed_alone_mm_s, alone_s, asked_s,
                              facts.extruder));
  }
  return std::nullopt;
}

// Checks that Klipper does not slow down between two stretches whose filament per mm differs, if
// only by rounding.
std::optional<Check> CheckFlowSteps(const PrinterFacts& facts) {
  // Positions have 1 um, filament 0.01 um: stretches of 4 mm differ by 2.8e-5, and pass at 35 mm/s.
  constexpr double kMin_mm_s = 0.001;
  if (facts.instantaneous_corner_velocity_mm_s.value_or(1) >= kMin_mm_s) return std::nullopt;
  return Unsafe("corners",
                fmt::format("instantaneous_corner_velocity of [{}] in printer.cfg is {:g} "
                            "mm/s: the head would stop between a line's stretches; set "
                            "it to 1, Klipper's default",
                            facts.extruder, *facts.instantaneous_corner_velocity_mm_s));
}

// Checks the smoothing time: a longer one spreads filament from one speed change to the other, and
// answers of virtual lines are 1 to 5 ms too high.
std::optional<Check> FindSmoothing(const PrinterFacts& facts) {
  constexpr double kLongest_s = 0.06;  // tuned on virtual prints, seeds below 1000
  for (const auto& [section, smooth_s] : facts.smooth_times_s) {
    if (smooth_s <= kLongest_s * (1 + kRounding)) continue;
    return Unsafe("smoothing",
                  fmt::format("smooth_time of [{}] is {:g} s, and lines can be read up to {:g} s: "
                              "SET_PRESSURE_ADVANCE EXTRUDER={} SMOOTH_TIME=0.04 sets Klipper's "
                              "default until it restarts, pressure_advance_smooth_time in "
                              "printer.cfg for good",
                              section, smooth_s, kLongest_s, machine::NameInGcode(section)));
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
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const auto status =
      TRY(session.printer.Query({{"configfile", {"settings"}}}, session.Within(kAsk_s)));
  return machine::FactsOf(status, state, extruder);
}

std::vector<Check> CompareFacts(const PrinterFacts& facts, const PrintNeeds& needs) {
  std::vector<Check> checks;
  if (auto unknown = FindUnknown(facts, needs)) checks.push_back(std::move(*unknown));
  if (!needs.motions.empty()) checks.push_back(CompareLimits(facts, needs));
  if (needs.filament_diameter_mm > 0) checks.push_back(CompareFilament(facts, needs));
  if (needs.nozzle_diameter_mm > 0) checks.push_back(CompareNozzle(facts, needs));
  if (auto much = FindTooMuch(facts, needs)) checks.push_back(std::move(*much));
  if (needs.bead_mm2 > 0) {
    if (auto stops = CheckFlowSteps(facts)) checks.push_back(std::move(*stops));
  }
  checks.push_back(CompareShape(facts, needs));
  if (needs.sets_pressure_advance) {
    checks.push_back(ComparePressureAdvance(facts, needs.advance_motors));
    if (auto smoothing = FindSmoothing(facts)) checks.push_back(std::move(*smoothing));
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
  if (!facts.pushes_for.empty() && facts.advance_motors.empty()) {
    return Unsafe(kName, fmt::format("the stepper of [{}] is synchronised with {}, and none pushes "
                                     "the filament of {}: SYNC_EXTRUDER_MOTION EXTRUDER={} "
                                     "MOTION_QUEUE={}",
                                     facts.extruder, facts.pushes_for, facts.extruder,
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
  if (facts.no_bed_heater && asked.bed_c > 0) {
    return Unsafe(kName, fmt::format("{}: the printer has no [heater_bed], and [filament] "
                                     "bed_temperature = {:.4g} degC: set bed_temperature = 0",
                                     shown, asked.bed_c));
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
