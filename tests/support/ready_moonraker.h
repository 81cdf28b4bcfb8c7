// The answers that a client needs before it gets to what a test is about.
#pragma once

#include <string>

#include "support/scripted_moonraker.h"

namespace trammel::test {

/// Lets the server answer identify, server.info, printer.info, objects.list, subscribe, query and
/// scripts ("ok") like a Moonraker whose Klipper is in the given state. The objects are a small
/// printer: homed, an extruder, a bed, a pin "output_pin LASER", a macro LASER_ON.
void AnswerLikeMoonraker(ScriptedMoonraker& server, const std::string& klippy_state = "ready");

/// The status of that small printer.
[[nodiscard]] nlohmann::json SmallPrinterStatus(const std::string& klippy_state = "ready");

/// notify_status_update with these objects.
[[nodiscard]] nlohmann::json StatusUpdate(const nlohmann::json& objects, double eventtime_s);
[[nodiscard]] nlohmann::json Notification(const std::string& method);

}  // namespace trammel::test
