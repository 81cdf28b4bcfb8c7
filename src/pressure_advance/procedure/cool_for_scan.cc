#include "pressure_advance/procedure/cool_for_scan.h"

#include <fmt/format.h>

#include "session/print.h"

namespace trammel::procedure {

Result<void> CoolForScan(const Session& session, const machine::PrinterState& state,
                         double nozzle_c, double time_limit_s) {
  const std::string& extruder = state.active_extruder;
  if (nozzle_c == 0) {
    session.Say(fmt::format("switching {} off, without waiting for it to cool", extruder));
    return SetTarget(session, extruder, 0);
  }
  const auto nozzle = state.heaters.find(extruder);
  const bool cold = nozzle != state.heaters.end() && nozzle->second.temperature_c <= nozzle_c &&
                    nozzle->second.target_c <= nozzle_c;
  return cold ? Result<void>{} : CoolAndWait(session, extruder, nozzle_c, time_limit_s);
}

}  // namespace trammel::procedure
