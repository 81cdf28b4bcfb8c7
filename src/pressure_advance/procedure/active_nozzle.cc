#include "pressure_advance/procedure/active_nozzle.h"

#include <fmt/format.h>

#include <algorithm>

#include "session/print_needs.h"

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

}  // namespace trammel::procedure
