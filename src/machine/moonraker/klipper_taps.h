// Taps over Klipper's own socket, for printers without Moonraker.
#pragma once

#include <memory>
#include <string>

#include "machine/moonraker/tap_stream.h"

namespace trammel::machine {

/// @param socket  Path of Klipper's API socket, as klippy's option -a has it.
/// Asks Klipper every second until it is ready, and connects again after restarts.
[[nodiscard]] Result<std::unique_ptr<TapStream>> OpenKlipperTaps(const std::string& socket,
                                                                 const std::string& remote_method,
                                                                 TapStreamEvents events,
                                                                 const WaitLimit& limit);

}  // namespace trammel::machine
