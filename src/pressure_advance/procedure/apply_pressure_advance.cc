#include "pressure_advance/procedure/apply_pressure_advance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "session/idle.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;

Result<void> CheckValue(double pressure_advance_s, const ApplyOptions& options) {
  constexpr double kMost_s = 10;
  if (!(pressure_advance_s >= 0 && pressure_advance_s <= kMost_s)) {  // false for NaN
    return Fail(fmt::format("pressure advance {} s: must lie within 0 ... {}", pressure_advance_s,
                            kMost_s));
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

}  // namespace

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
  if (auto sane = CheckValue(pressure_advance_s, options); !sane) {
    return tl::unexpected(sane.error());
  }
  if (auto idle = RefuseWhilePrinting(session, "the pressure advance"); !idle) {
    return tl::unexpected(idle.error());
  }
  const auto before = session.printer.State(session.Within(kAsk_s));
  if (!before) return tl::unexpected(before.error());
  const PressureAdvanceChange change{machine::ActiveAdvance_s(*before), pressure_advance_s};
  if (options.dry_run) return change;
  if (options.before_setting) {
    if (auto may = options.before_setting(change.before_s); !may) {
      return tl::unexpected(may.error());
    }
  }
  // What is begun is seen through, also where somebody stops the program: seconds, and the answer
  // says what is in force.
  if (session.stop.stop_requested()) {
    return Fail("stopped before the pressure advance was set", ErrorKind::kInterrupted);
  }
  const machine::WaitLimit through{kAsk_s, {}};
  auto set = session.printer.Run(
      fmt::format("SET_PRESSURE_ADVANCE ADVANCE={:.4f}", pressure_advance_s), through);
  if (set) set = session.printer.FinishMoves(through);
  if (!set) return tl::unexpected(set.error());
  const auto state = session.printer.State(through);
  if (!state) return tl::unexpected(state.error());
  constexpr double kRounding_s = 0.0001;
  const auto now_s = machine::ActiveAdvance_s(*state);
  if (!now_s || std::abs(*now_s - pressure_advance_s) > kRounding_s) {
    return Fail(
        fmt::format("the printer was told to use a pressure advance of {:.4f} s and reports "
                    "{:.4f} s",
                    pressure_advance_s, now_s.value_or(std::nan(""))),
        ErrorKind::kMachine);
  }
  return change;
}

}  // namespace trammel::procedure
