#include "machine/moonraker/printer_state.h"

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

}  // namespace trammel::machine
