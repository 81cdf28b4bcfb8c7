// The G-code commands of the virtual Klipper.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/gcode/command.h"
#include "sim/klipper/machine.h"

namespace trammel::sim {

/// Of klipper-toolchanger, in the order of ToolConfig::offset_mm.
inline constexpr std::array<const char*, 3> kToolOffsetNames = {"gcode_x_offset", "gcode_y_offset",
                                                                "gcode_z_offset"};

/// What a number must keep to.
struct NumberRule {
  std::optional<double> minimum;
  std::optional<double> above;
  std::optional<double> maximum;
};

/// A finite number of a long command or a parameter letter; absent where it is not given. The error
/// is Klipper's: "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have minimum of 0.0".
[[nodiscard]] Result<std::optional<double>> FloatOf(const Command& line, const std::string& key,
                                                    const NumberRule& rule = {});

/// The same, required: "Error on '…': missing ADVANCE".
[[nodiscard]] Result<double> RequiredFloat(const Command& line, const std::string& key,
                                           const NumberRule& rule = {});

[[nodiscard]] Result<std::string> RequiredText(const Command& line, const std::string& key);

/// A number as Python prints it: 0.0, 1.5.
[[nodiscard]] std::string PythonNumber(double value);

/// What a command leaves to be done before the next line of its script.
struct Outcome {
  Wait wait;                       ///< empty: nothing to wait for
  std::vector<std::string> lines;  ///< to be read next
};

using Handler = Result<Outcome> (*)(VirtualKlipper&, const Command&);

/// Finds and runs a command. Unknown ones are told as a response and are no error. Errors are in
/// Klipper's words.
[[nodiscard]] Result<Outcome> RunCommand(VirtualKlipper& machine, const Command& line);

/// One table per family of commands.
[[nodiscard]] const std::map<std::string, Handler>& MotionCommands();
[[nodiscard]] const std::map<std::string, Handler>& SettingCommands();
[[nodiscard]] const std::map<std::string, Handler>& HeatCommands();
[[nodiscard]] const std::map<std::string, Handler>& HostCommands();
[[nodiscard]] const std::map<std::string, Handler>& VariableCommands();
/// Only where there is a load cell.
[[nodiscard]] const std::map<std::string, Handler>& ProbeCommands();
/// Only where there are tools.
[[nodiscard]] const std::map<std::string, Handler>& ToolCommands();
/// All tables of a machine, in the order in which commands are looked up.
[[nodiscard]] std::vector<const std::map<std::string, Handler>*> CommandTables(
    const VirtualKlipper& machine);

/// Whether it is T0, T1, ... of a tool that the machine has.
[[nodiscard]] bool IsToolChange(const VirtualKlipper& machine, const std::string& name);
[[nodiscard]] Result<Outcome> ChangeTool(VirtualKlipper& machine, const Command& line);

/// Waits until everything queued has been made.
[[nodiscard]] Outcome WaitForMoves(VirtualKlipper& machine);

/// Queues a straight move to x, y, z, e; the wait is for room in the queue.
[[nodiscard]] Result<Outcome> MoveTo(VirtualKlipper& machine, const std::array<double, 4>& to_mm,
                                     double speed_mm_s);

}  // namespace trammel::sim
