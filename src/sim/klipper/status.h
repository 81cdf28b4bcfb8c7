// What the virtual Klipper's objects say of themselves.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/klipper/machine.h"

namespace trammel::sim {

/// The names that printer.objects.list gives.
[[nodiscard]] std::vector<std::string> ObjectNames(const VirtualKlipper& machine);

/// What printer.gcode.help gives: the help of each command that has one.
[[nodiscard]] nlohmann::json GcodeHelp(const VirtualKlipper& machine);

/// All fields of one object at the machine's present time; an empty object for an unknown name.
[[nodiscard]] nlohmann::json ObjectStatus(const VirtualKlipper& machine, const std::string& name);

}  // namespace trammel::sim
