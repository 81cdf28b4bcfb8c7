// What a machine has room for, on the command line: its travel, what stands in it, the camera.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/views/machine_box.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct MachineBoxArguments {
  std::vector<double> travel;     ///< six numbers, or none
  std::vector<double> obstacles;  ///< six each
  double camera_radius_mm = 80;   ///< of what hangs in the spindle, a cylinder about its axis
  double camera_below_mm = 0;     ///< as part_alignment::ToolLength takes it
};

/// Adds --travel, --obstacle, --camera-radius, --camera-below, in a group of the help.
void AddMachineBoxes(CLI::App& command, MachineBoxArguments& arguments,
                     const std::string& group = "Options");

/// @returns One box for each six numbers: the least X, Y, Z and the most X, Y, Z.
/// Errors: numbers left over.
[[nodiscard]] Result<std::vector<part_alignment::MachineBox>> ObstaclesOf(
    const MachineBoxArguments& arguments);

/// REQUIRES six numbers.
[[nodiscard]] part_alignment::MachineBox TravelOf(const MachineBoxArguments& arguments);

}  // namespace trammel::app
