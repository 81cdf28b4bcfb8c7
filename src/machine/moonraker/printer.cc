#include "machine/moonraker/printer.h"

namespace trammel::machine {

std::string_view ToString(PrinterReadiness readiness) {
  switch (readiness) {
    case PrinterReadiness::kReady:
      return "ready";
    case PrinterReadiness::kStartup:
      return "startup";
    case PrinterReadiness::kShutdown:
      return "shutdown";
    case PrinterReadiness::kError:
      return "error";
    case PrinterReadiness::kDisconnected:
      return "disconnected";
  }
  return "disconnected";
}

std::optional<double> ActiveAdvance_s(const PrinterState& state) {
  const auto own = state.pressure_advance.find(state.active_extruder);
  if (own == state.pressure_advance.end()) return std::nullopt;
  return own->second.advance_s;
}

std::string FirstLine(std::string_view message) {
  return std::string(message.substr(0, message.find('\n')));
}

std::string NameInGcode(std::string_view section) {
  return std::string(section.substr(section.rfind(' ') + 1));
}

}  // namespace trammel::machine
