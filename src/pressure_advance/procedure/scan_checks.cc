#include "pressure_advance/procedure/scan_checks.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "pressure_advance/pattern/pattern.h"

namespace trammel::procedure {
namespace {

using pressure_advance::PatternConfig;
using pressure_advance::PatternPlan;
using settings::ScanSettings;

Check CheckSweeps(const PatternPlan& plan, const ScanSettings& settings, const Reach& reach) {
  const auto sweeps = PlanSweeps(plan, {}, settings, reach);
  if (!sweeps) return Miss("bed", sweeps.error().message);
  return Pass("bed", "pattern and scan lie within the nozzle's reach");
}

// Whether the nozzle reaches the whole pattern.
Check CheckPattern(const PatternConfig& pattern, const Reach& reach) {
  if (const auto problem = FindProblem(pattern)) {
    return Miss("bed",
                fmt::format("[{}] {}: {}", problem->section, problem->key, problem->message));
  }
  const auto printed = LayOut(pattern).printed;
  if (!reach.Contains(printed)) {
    return Miss(
        "bed", fmt::format("the pattern covers X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm, "
                           "the nozzle reaches X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm: "
                           "set bed_size_x, bed_size_y, bed_origin_x and bed_origin_y of [printer]",
                           printed.min_x_mm, printed.max_x_mm, printed.min_y_mm, printed.max_y_mm,
                           reach.minimum_mm[0], reach.maximum_mm[0], reach.minimum_mm[1],
                           reach.maximum_mm[1]));
  }
  return Pass("bed", "the pattern lies within the nozzle's reach");
}

Check CheckBed(const PatternConfig& pattern, const ScanSettings& settings, const Reach& reach) {
  Check reached = CheckPattern(pattern, reach);
  if (!reached.passed) return reached;
  return CheckSweeps(MakePlan(LayOut(pattern), pattern, "pattern.gcode"), settings, reach);
}

}  // namespace

Reach ReachOf(const machine::PrinterState& state) {
  return {state.axis_minimum_mm, state.axis_maximum_mm};
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

std::vector<Check> CheckPrinter(const Session& session, const PatternConfig& pattern,
                                const ScanSettings& settings,
                                const std::optional<PatternPlan>& plan) {
  std::vector<Check> checks = CheckLaserCommands(session, pattern, settings);
  if (!checks.front().passed || checks.size() < 3) return checks;
  const Reach reach = ReachOf(session.printer.LastState());
  checks.push_back(plan ? CheckSweeps(*plan, settings, reach) : CheckBed(pattern, settings, reach));
  return checks;
}

std::vector<Check> CheckForPrint(const Session& session, const PatternConfig& pattern) {
  std::vector<Check> checks = CheckReady(session);
  if (!checks.front().passed || checks.size() < 2) return checks;
  checks.push_back(CheckCommands(session, "[printer] start_gcode", pattern.start_gcode));
  checks.push_back(CheckCommands(session, "[printer] end_gcode", pattern.end_gcode));
  checks.push_back(CheckLimit(session));
  checks.push_back(CheckPattern(pattern, ReachOf(session.printer.LastState())));
  return checks;
}

}  // namespace trammel::procedure
