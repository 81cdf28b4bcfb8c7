// Answer of server.webcams.list.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "machine/moonraker/link/address.h"
#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Omits malformed entries; makes relative URLs absolute. They are relative to the web interface's
/// host and port, not to Moonraker's: port 80 of the same computer if `address` is Moonraker's own
/// port, and that port if a proxy serves both. If that proxy serves both below a path, a URL
/// without a leading slash is also below that path.
[[nodiscard]] std::vector<Webcam> ReadWebcams(const nlohmann::json& answer,
                                              const MoonrakerAddress& address);

/// Returns the first enabled webcam whose service is an MJPEG stream. @param name  empty: any
/// Errors: kMachine: there is none; the message names the service of one that exists.
[[nodiscard]] Result<Webcam> ChooseWebcam(const std::vector<Webcam>& webcams,
                                          const std::string& name);

}  // namespace trammel::machine
