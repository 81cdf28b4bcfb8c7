// What shall go wrong with a virtual printer and its camera: --fault NAME=NUMBER.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "sim/camera/camera_fault.h"
#include "sim/klipper/config.h"
#include "sim/moonraker/hub.h"

namespace trammel::app {

struct PrinterFaults {
  sim::KlipperFaults klipper;
  sim::ServerFaults server;
};

/// Names, separated by commas.
[[nodiscard]] std::string PrinterFaultNames();
[[nodiscard]] std::string CameraFaultNames();

/// Reads NAME=NUMBER into what the name belongs to.
/// @param camera  null where there is no camera to go wrong.
/// Error (kInput): another form, a number outside 0 … 1e6, or a name that is not there.
[[nodiscard]] Result<void> SetFault(const std::string& text, PrinterFaults* printer,
                                    std::vector<sim::CameraFault>* camera);

}  // namespace trammel::app
