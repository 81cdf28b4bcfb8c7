#include "pressure_advance/procedure/scan_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using settings::ScanSettings;

Check CheckSweeps(const PatternPlan& plan, const ScanSettings& settings, const Reach& reach) {
  const auto sweeps = PlanSweeps(plan, {}, settings, reach);
  if (!sweeps) return Unsafe("bed", sweeps.error().message);
  return Pass("bed", "pattern and scan lie within the nozzle's reach");
}

// Checks that the nozzle's heights are within its reach.
std::optional<Check> FindHeightBeyond(const PatternConfig& pattern, const Reach& reach) {
  double lowest_mm = ParkPoint(pattern).z_mm, highest_mm = lowest_mm;
  for (const auto& move : LayOut(pattern).moves) {
    lowest_mm = std::min(lowest_mm, move.to.z_mm);
    highest_mm = std::max({highest_mm, move.from.z_mm, move.to.z_mm});
  }
  if (lowest_mm >= reach.minimum_mm[2] && highest_mm <= reach.maximum_mm[2]) return std::nullopt;
  return Unsafe("bed",
                fmt::format("the nozzle goes to Z = {:.2f} ... {:.2f} mm, and reaches {:.2f} "
                            "... {:.2f} mm{}: set park_lift, approach_lift or z_offset, or "
                            "position_min and position_max of [stepper_z]",
                            lowest_mm, highest_mm, reach.minimum_mm[2], reach.maximum_mm[2],
                            reach.offset_mm[2] != 0
                                ? fmt::format(" with the G-code offset {:g} mm", reach.offset_mm[2])
                                : ""));
}

// Finds a stretch of a line at which a polar printer's bed would have to turn too fast: Klipper
// then lowers both limits in proportion.
std::optional<Check> FindTurnTooFast(const PatternConfig& pattern,
                                     const machine::PrinterFacts& facts) {
  if (!facts.max_angular_velocity_rad_s) return std::nullopt;
  const double max_rad_s = *facts.max_angular_velocity_rad_s;
  for (const auto& move : LayOut(pattern).moves) {
    if (move.kind != pressure_advance::MoveKind::kLine) continue;
    // Lines are along X.
    const double lo_mm = std::min(move.from.x_mm, move.to.x_mm) + facts.reach.offset_mm[0];
    const double hi_mm = std::max(move.from.x_mm, move.to.x_mm) + facts.reach.offset_mm[0];
    const double nearest_mm =
        std::hypot(std::clamp(0.0, lo_mm, hi_mm), move.from.y_mm + facts.reach.offset_mm[1]);
    const double turns_rad_s = move.speed_mm_s / nearest_mm;
    if (nearest_mm == 0 || turns_rad_s <= max_rad_s) continue;  // Klipper lets the centre pass
    const double acceleration_mm_s2 = SettingsOf(pattern, move.pattern).acceleration_mm_s2;
    const double needed = std::max(move.speed_mm_s / facts.configured_max_velocity_mm_s,
                                   acceleration_mm_s2 / facts.configured_max_accel_mm_s2);
    if (max_rad_s / turns_rad_s >= needed) continue;
    return Unsafe(
        "limits",
        fmt::format("{:g} mm/s turn the bed at {:.3g} rad/s {:.1f} mm from the centre, and "
                    "max_angular_velocity of [printer] in printer.cfg is {:g}: set position_x or "
                    "position_y {:.0f} mm off the centre, lower the speed, or raise it",
                    move.speed_mm_s, turns_rad_s, nearest_mm, max_rad_s,
                    std::ceil(std::min(1.0, needed) * move.speed_mm_s / max_rad_s)));
  }
  return std::nullopt;
}

// Checks that the nozzle reaches the whole pattern.
Check CheckPattern(const PatternConfig& pattern, const machine::PrinterFacts& facts) {
  const Reach& reach = facts.reach;
  if (const auto problem = FindProblem(pattern)) {
    return Unsafe("bed",
                  fmt::format("[{}] {}: {}", problem->section, problem->key, problem->message));
  }
  const auto printed = LayOut(pattern).printed;
  constexpr const char* kSetBed =
      "set bed_size_x, bed_size_y, bed_origin_x, bed_origin_y and bed_shape of [printer]";
  if (!reach.Contains(printed)) {
    return Unsafe(
        "bed", fmt::format("the pattern covers X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm, the "
                           "nozzle reaches {}: {}",
                           printed.min_x_mm, printed.max_x_mm, printed.min_y_mm, printed.max_y_mm,
                           reach.Describe(), kSetBed));
  }
  const auto park = settings::ParkPositionOf(pattern);
  if (!reach.Contains(park.x_mm, park.y_mm)) {
    return Unsafe("bed", fmt::format("the nozzle is to wait at ({:.1f}, {:.1f}) mm, and reaches "
                                     "{}: {}, or park_x and park_y",
                                     park.x_mm, park.y_mm, reach.Describe(), kSetBed));
  }
  if (auto beyond = FindHeightBeyond(pattern, reach)) return *std::move(beyond);
  if (auto turn = FindTurnTooFast(pattern, facts)) return *std::move(turn);
  return Pass("bed", "the pattern lies within the nozzle's reach");
}

Check CheckBed(const PatternConfig& pattern, const ScanSettings& settings,
               const machine::PrinterFacts& facts) {
  Check reached = CheckPattern(pattern, facts);
  if (!reached.passed) return reached;
  return CheckSweeps(MakePlan(LayOut(pattern), pattern, "pattern.gcode"), settings, facts.reach);
}

// Adds checks: ready, idle, and no stated obstacle to the print.
void AddFacts(const machine::PrinterFacts& facts, const CheckedPattern& checked,
              std::vector<Check>& checks) {
  for (Check& check : CompareFacts(facts, NeedsOf(checked))) checks.push_back(std::move(check));
  if (checked.prints) checks.push_back(CompareTemperatures(facts, checked.pattern));
}

}  // namespace

PrintNeeds NeedsOf(const CheckedPattern& checked) {
  const PatternConfig& pattern = checked.pattern;
  PrintNeeds needs;
  needs.printed_before = !checked.prints;
  if (checked.plan) {
    double fastest_mm_s = 0;
    for (const auto& segment : checked.plan->segments) {
      fastest_mm_s = std::max(fastest_mm_s, segment.speed_mm_s);
    }
    needs.motions.push_back({fastest_mm_s, checked.plan->acceleration_mm_s2});
  } else {
    for (int i = 0; i < PatternCount(pattern); ++i) {
      const PatternConfig one = SettingsOf(pattern, i);
      needs.motions.push_back({FastSpeed_mm_s(one), one.acceleration_mm_s2});
    }
  }
  needs.rectangular_bed = pattern.bed_shape == settings::BedShape::kRectangle;
  if (!checked.prints) return needs;
  needs.sets_pressure_advance = true;
  needs.advance_motors = pattern.advance_motors;
  needs.filament_diameter_mm = pattern.filament_diameter_mm;
  needs.nozzle_diameter_mm = pattern.nozzle_diameter_mm;
  needs.bead_mm2 = gcode::BeadArea_mm2(pattern.line_width_mm, pattern.layer_height_mm);
  needs.pushed_alone_mm = std::max(pattern.retract_length_mm, pattern.prime_length_mm);
  needs.pushed_alone_mm_s = pattern.retract_speed_mm_s;
  return needs;
}

Result<Reach> ReachOf(const Session& session) {
  const auto facts = TRY(ReadFacts(session));
  return facts.reach;
}

std::vector<Check> CheckLaserCommands(const Session& session, const PatternConfig& pattern,
                                      const ScanSettings& settings) {
  std::vector<Check> checks = CheckReady(session);
  if (!checks.front().passed || checks.size() < 2) return checks;
  checks.push_back(settings.laser_on_gcode.empty() || settings.laser_off_gcode.empty()
                       ? Miss("[scan] laser_on_gcode",
                              "laser_on_gcode and laser_off_gcode must "
                              "both be set: nothing is scanned with a "
                              "laser that cannot be switched off")
                       : CheckCommands(session, "[scan] laser_on_gcode", settings.laser_on_gcode));
  for (const auto& [name, gcode] : {std::pair{"[scan] laser_off_gcode", &settings.laser_off_gcode},
                                    {"[scan] lights_off_gcode", &settings.lights_off_gcode},
                                    {"[scan] lights_on_gcode", &settings.lights_on_gcode},
                                    {"[scan] clean_nozzle_gcode", &settings.clean_nozzle_gcode},
                                    {"[printer] start_gcode", &pattern.start_gcode},
                                    {"[printer] idle_gcode", &pattern.idle_gcode}}) {
    checks.push_back(CheckCommands(session, name, *gcode));
  }
  checks.push_back(CheckLimit(session));
  return checks;
}

std::vector<Check> CheckPrinter(const Session& session, const CheckedPattern& checked,
                                const ScanSettings& settings) {
  std::vector<Check> checks = CheckLaserCommands(session, checked.pattern, settings);
  if (!checks.front().passed || checks.size() < 3) return checks;
  const auto facts = ReadFacts(session);
  if (!facts) {
    checks.push_back(NotMade("printer.cfg", facts.error()));
    return checks;
  }
  AddFacts(*facts, checked, checks);
  checks.push_back(checked.plan ? CheckSweeps(*checked.plan, settings, facts->reach)
                                : CheckBed(checked.pattern, settings, *facts));
  return checks;
}

std::vector<Check> CheckForPrint(const Session& session, const CheckedPattern& checked) {
  const PatternConfig& pattern = checked.pattern;
  std::vector<Check> checks = CheckReady(session);
  if (!checks.front().passed || checks.size() < 2) return checks;
  checks.push_back(CheckCommands(session, "[printer] start_gcode", pattern.start_gcode));
  checks.push_back(CheckCommands(session, "[printer] end_gcode", pattern.end_gcode));
  checks.push_back(CheckLimit(session));
  const auto facts = ReadFacts(session);
  if (!facts) {
    checks.push_back(NotMade("printer.cfg", facts.error()));
    return checks;
  }
  AddFacts(*facts, checked, checks);
  checks.push_back(CheckPattern(pattern, *facts));
  return checks;
}

}  // namespace trammel::procedure
