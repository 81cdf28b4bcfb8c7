// A printer behind Moonraker (Klipper's web server).
#pragma once

#include <memory>

#include "base/result.h"
#include "machine/moonraker/moonraker_options.h"
#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Connects, identifies, subscribes and stays connected: reconnects with growing pauses (0.5 …
/// 10 s), and subscribes again after each restart of the firmware.
/// Succeeds when the server lets us in, whether or not the firmware is ready (see LastState and
/// WaitUntilReady). Fails with kInput for an address or option that makes no sense, and with
/// kMachine, each with its own remedy, for: name not found, refused, no answer, not a Moonraker,
/// TLS, not authorised.
[[nodiscard]] Result<std::unique_ptr<Printer>> ConnectToMoonraker(const MoonrakerOptions& options,
                                                                  const WaitLimit& limit);

}  // namespace trammel::machine
