// Status of the virtual Klipper's objects.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/klipper/machine.h"

namespace trammel::sim {

/// Returns the names in printer.objects.list.
[[nodiscard]] std::vector<std::string> ObjectNames(const VirtualKlipper& machine);

/// Returns the result of printer.gcode.help: the help of each command that has one.
[[nodiscard]] nlohmann::json GcodeHelp(const VirtualKlipper& machine);

/// Returns all fields of one object at the machine's present time; an empty object for an unknown
/// name.
[[nodiscard]] nlohmann::json ObjectStatus(const VirtualKlipper& machine, const std::string& name);

}  // namespace trammel::sim
