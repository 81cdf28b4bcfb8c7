// The answer of server.webcams.list.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "machine/moonraker/link/address.h"
#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Entries of a wrong form are left out; URLs that are relative become absolute. They are relative
/// to the web interface's host and port, not to Moonraker's: port 80 of the same computer where
/// `address` is Moonraker itself on a port of its own, and that port where a proxy serves both. Of
/// a proxy that serves both below a path, a URL that does not begin with a slash lies there, too.
[[nodiscard]] std::vector<Webcam> ReadWebcams(const nlohmann::json& answer,
                                              const MoonrakerAddress& address);

/// The first enabled webcam whose stream is MJPEG, by its service. @param name  empty: any
/// Errors: kMachine: there is none; the message names the service of one that is there.
[[nodiscard]] Result<Webcam> ChooseWebcam(const std::vector<Webcam>& webcams,
                                          const std::string& name);

}  // namespace trammel::machine
