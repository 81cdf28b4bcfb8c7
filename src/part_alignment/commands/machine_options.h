// Options of numbers and of a machine: how LinuxCNC is reached, its travel, what stands in it, the
// camera's size.
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

/// Adds a number within bounds, with what it is without the option in the help.
void AddNumber(CLI::App& command, const std::string& option, double& value, const std::string& help,
               double least, double most, const std::string& group = "Options");

struct LinuxCncArguments {
  std::string address;  ///< "session", or "session:" and a helper's words; empty: no machine
  machine::LinuxCncOptions options;
};

/// `option` names the address: --write, --machine.
void AddLinuxCncOptions(CLI::App& command, const std::string& option, const std::string& help,
                        LinuxCncArguments& arguments);

/// Errors (kInput): an address that is none.
[[nodiscard]] Result<machine::LinuxCncOptions> ParseLinuxCnc(const LinuxCncArguments& arguments);

/// Connects, and takes MDI mode where nothing forbids a motion.
/// Errors: those of ParseLinuxCnc, LinuxCnc::Connect and LinuxCnc::Prepare.
[[nodiscard]] Result<std::unique_ptr<machine::LinuxCnc>> ConnectLinuxCnc(
    const LinuxCncArguments& arguments, const std::stop_token& stop);

/// Where the spindle stands. Errors (kSafety): it turns; its axis C is not at `c_deg`, if any.
[[nodiscard]] Result<Eigen::Vector3d> StandsAt(machine::LinuxCnc& linuxcnc,
                                               std::optional<double> c_deg,
                                               const std::stop_token& stop);

struct MachineBoxArguments {
  std::vector<double> travel;     ///< six numbers, or none
  std::vector<double> obstacles;  ///< six each
  double camera_radius_mm = 80;   ///< of what hangs in the spindle, a cylinder about its axis
  double camera_below_mm = 0;     ///< as part_alignment::ToolLength takes it
};

/// Adds --travel, --obstacle, --camera-radius, --camera-below, in a group of the help.
void AddMachineBoxes(CLI::App& command, MachineBoxArguments& arguments,
                     const std::string& group = "Options");

/// The box of six numbers from `from` on: the least X, Y, Z and the most X, Y, Z.
[[nodiscard]] part_alignment::MachineBox BoxOf(const std::vector<double>& n, std::size_t from);

/// @returns One box for each six numbers: the least X, Y, Z and the most X, Y, Z.
/// Errors: numbers left over.
[[nodiscard]] Result<std::vector<part_alignment::MachineBox>> ObstaclesOf(
    const MachineBoxArguments& arguments);

/// REQUIRES six numbers.
[[nodiscard]] part_alignment::MachineBox TravelOf(const MachineBoxArguments& arguments);

}  // namespace trammel::app
