#include "pressure_advance/procedure/apply_pressure_advance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gcode/dialect.h"
#include "session/print_needs.h"
#include "session/session.h"

namespace trammel::procedure {

Result<ActiveNozzle> AskActiveNozzle(const Session& session) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  if (state.readiness != machine::PrinterReadiness::kReady) {
    return Fail(fmt::format("the printer is \"{}\", and tells nothing of its nozzle: begin again "
                            "when it is ready{}",
                            machine::ToString(state.readiness),
                            state.message.empty() ? "" : ". " + state.message),
                ErrorKind::kMachine);
  }
  const auto facts = ReadFacts(session);
  if (!facts) return tl::unexpected(facts.error());
  const std::string& extruder = state.active_extruder;
  const bool is_name = !extruder.empty() && std::ranges::all_of(extruder, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
  if (!is_name || !facts->nozzle_diameter_mm) {
    return Fail(
        fmt::format("the printer tells no nozzle_diameter of its active extruder '{}'", extruder),
        ErrorKind::kMachine);
  }
  return ActiveNozzle{extruder, *facts->nozzle_diameter_mm};
}

namespace {

constexpr double kAsk_s = 10;

Result<void> CheckValue(double pressure_advance_s, const ApplyOptions& options) {
  constexpr double kMax_s = 10;
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMax_s)) {  // false for NaN
    return Fail(
        fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s, kMax_s));
  }
  if (options.force || pressure_advance_s <= options.limit_s) return {};
  return Fail(
      fmt::format("pressure advance {:.4f} s is above {:.4g} s ([printer] pressure_advance_limit): "
                  "direct drives need up to about 0.2 s, which is how far the tower of Klipper's "
                  "documentation tries, Bowden tubes up to 1 s, seldom 1.5 s; raise the limit, or "
                  "say --force",
                  pressure_advance_s, options.limit_s),
      ErrorKind::kSafety);
}

// Returns the command; without a name, the active extruder's own.
std::string CommandFor(const std::string& name, double pressure_advance_s) {
  gcode::AdvanceMotors motors;
  if (!name.empty()) motors.names.push_back(name);
  return PressureAdvanceCommands(gcode::Dialect::kKlipper,
                                 fmt::format("{:.4f}", pressure_advance_s), motors)
      .front();
}

// Returns all motors in their present state. A single one needs no name.
std::vector<MotorChange> MotorsOf(const machine::PrinterFacts& facts,
                                  const machine::PrinterState& state, double pressure_advance_s,
                                  const std::map<std::string, double>& own_s) {
  std::vector<std::string> sections = facts.advance_motors;
  if (sections.empty()) sections.push_back(facts.extruder);
  const bool named = !facts.advance_names().empty();
  std::vector<MotorChange> motors;
  for (const std::string& section : sections) {
    const auto known = state.pressure_advance.find(section);
    const auto own = own_s.find(section);
    const double after_s = own == own_s.end() ? pressure_advance_s : own->second;
    motors.push_back({section, CommandFor(named ? machine::NameInGcode(section) : "", after_s),
                      known == state.pressure_advance.end()
                          ? std::nullopt
                          : std::optional(known->second.advance_s),
                      after_s});
  }
  return motors;
}

Result<void> SetAndReadBack(const Session& session, const PressureAdvanceChange& change) {
  // A begun change is completed even if the program is stopped: it takes seconds, and the answer
  // shows the value in force.
  const machine::WaitLimit through{kAsk_s, {}};
  for (const MotorChange& motor : change.motors) {
    TRY(session.printer.Run(motor.command, through));
  }
  TRY(session.printer.FinishMoves(through));
  const auto state = TRY(session.printer.State(through));
  constexpr double kRounding_s = 0.0001;
  for (const MotorChange& motor : change.motors) {
    const auto now = state.pressure_advance.find(motor.section);
    const bool told = now != state.pressure_advance.end();
    if (told && std::abs(now->second.advance_s - motor.after_s) <= kRounding_s) continue;
    return Fail(
        fmt::format("the printer was told to use a pressure advance of {:.4f} s for {} and reports "
                    "{}",
                    motor.after_s, motor.section,
                    told ? fmt::format("{:.4f} s", now->second.advance_s) : "none"),
        ErrorKind::kMachine);
  }
  return {};
}

// Restores several motors: all are set or none.
void BringBack(const Session& session, const PressureAdvanceChange& change) {
  if (change.motors.size() < 2) return;
  for (const MotorChange& motor : change.motors) {
    if (!motor.before_s) continue;
    (void)session.printer.Run(CommandFor(machine::NameInGcode(motor.section), *motor.before_s),
                              {kAsk_s, {}});
  }
}

}  // namespace

std::map<std::string, double> BeforeEach(const PressureAdvanceChange& change) {
  std::map<std::string, double> before;
  if (change.motors.size() < 2) return before;
  for (const MotorChange& motor : change.motors) {
    if (motor.before_s) before[motor.section] = *motor.before_s;
  }
  return before;
}

double ApplyLimit_s(const pressure_advance::PatternConfig& settings) {
  double limit_s = settings.pressure_advance_limit_s;
  if (settings.pressure_advances_s.empty()) {
    return std::max(limit_s, settings.pressure_advance_end_s);
  }
  for (const double value_s : settings.pressure_advances_s) limit_s = std::max(limit_s, value_s);
  return limit_s;
}

Result<PressureAdvanceChange> ApplyPressureAdvance(const Session& session,
                                                   double pressure_advance_s,
                                                   const ApplyOptions& options) {
  auto sane = CheckValue(pressure_advance_s, options);
  for (const auto& [section, own_s] : options.own_s) {
    if (sane) sane = CheckValue(own_s, options);
  }
  if (!sane) return tl::unexpected(sane.error());
  TRY(RefuseWhilePrinting(session, "the pressure advance"));
  const auto before = TRY(session.printer.State(session.Within(kAsk_s)));
  const auto facts = TRY(ReadFacts(session));
  TRY(FirstFailure({ComparePressureAdvance(facts, facts.advance_names())}, ErrorKind::kSafety));
  PressureAdvanceChange change{machine::ActiveAdvance_s(before), pressure_advance_s,
                               MotorsOf(facts, before, pressure_advance_s, options.own_s)};
  if (options.dry_run) return change;
  if (options.before_setting) {
    TRY(options.before_setting(change));
  }
  if (session.stop.stop_requested()) {
    return Fail("stopped before the pressure advance was set", ErrorKind::kInterrupted);
  }
  if (auto set = SetAndReadBack(session, change); !set) {
    BringBack(session, change);
    return tl::unexpected(set.error());
  }
  return change;
}

}  // namespace trammel::procedure
