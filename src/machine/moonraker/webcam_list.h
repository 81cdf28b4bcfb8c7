// The answer of server.webcams.list.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "machine/moonraker/moonraker_address.h"
#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Entries of a wrong form are left out; URLs that are relative become absolute. They are relative
/// to the web interface's host and port, not to Moonraker's: port 80 of the same computer where
/// `address` is Moonraker itself on a port of its own, and that port where a proxy serves both.
[[nodiscard]] std::vector<Webcam> ReadWebcams(const nlohmann::json& answer,
                                              const MoonrakerAddress& address);

}  // namespace trammel::machine
