// Options for numbers and for a machine: the link to LinuxCNC, travel, obstacles, camera size.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc.h"
#include "part_alignment/views/machine_box.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Adds a number within bounds, with its default in the help.
void AddNumber(CLI::App& command, const std::string& option, double& value, const std::string& help,
               double least, double most, const std::string& group = "Options");

struct LinuxCncArguments {
  std::string address;  ///< "session", or "session:" and a helper's words; empty: no machine
  machine::LinuxCncOptions options;
};

/// `option` names the address: --write, --machine.
void AddLinuxCncOptions(CLI::App& command, const std::string& option, const std::string& help,
                        LinuxCncArguments& arguments);

/// Errors (kInput): an invalid address.
[[nodiscard]] Result<machine::LinuxCncOptions> ParseLinuxCnc(const LinuxCncArguments& arguments);

/// Connects, and switches to MDI mode if nothing forbids a motion. Errors: those of ParseLinuxCnc,
/// LinuxCnc::Connect and LinuxCnc::Prepare.
[[nodiscard]] Result<std::unique_ptr<machine::LinuxCnc>> ConnectLinuxCnc(
    const LinuxCncArguments& arguments, const std::stop_token& stop);

/// Returns the spindle's position. Errors (kSafety): it turns; axis C, if any, is not at `c_deg`.
[[nodiscard]] Result<Eigen::Vector3d> StandsAt(machine::LinuxCnc& linuxcnc,
                                               std::optional<double> c_deg,
                                               const std::stop_token& stop);

struct MachineBoxArguments {
  std::vector<double> travel;     ///< six numbers, or none
  std::vector<double> obstacles;  ///< six each
  double camera_radius_mm = 80;   ///< bounding cylinder of the camera, about the spindle's axis
  double camera_below_mm = 0;     ///< as in part_alignment::ToolLength
};

/// Adds --travel, --obstacle, --camera-radius, --camera-below, in a group of the help.
void AddMachineBoxes(CLI::App& command, MachineBoxArguments& arguments,
                     const std::string& group = "Options");

/// Returns the box of six numbers from `from` on: the minimum X, Y, Z and the maximum X, Y, Z.
[[nodiscard]] part_alignment::MachineBox BoxOf(const std::vector<double>& n, std::size_t from);

/// @returns One box for each six numbers: the least X, Y, Z and the most X, Y, Z.
/// Errors: numbers left over.
[[nodiscard]] Result<std::vector<part_alignment::MachineBox>> ObstaclesOf(
    const MachineBoxArguments& arguments);

/// REQUIRES six numbers.
[[nodiscard]] part_alignment::MachineBox TravelOf(const MachineBoxArguments& arguments);

}  // namespace trammel::app
