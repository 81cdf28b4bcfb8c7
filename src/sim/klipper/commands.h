// G-code commands of the virtual Klipper.
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

/// Names of klipper-toolchanger, in the order of ToolConfig::offset_mm.
inline constexpr std::array<const char*, 3> kToolOffsetNames = {"gcode_x_offset", "gcode_y_offset",
                                                                "gcode_z_offset"};

/// Bounds of a number.
struct NumberRule {
  std::optional<double> minimum;
  std::optional<double> above;
  std::optional<double> maximum;
};

/// Returns a finite number of a long command or a parameter letter; absent if it is not given. The
/// error is Klipper's: "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have minimum of
/// 0.0".
[[nodiscard]] Result<std::optional<double>> FloatOf(const Command& line, const std::string& key,
                                                    const NumberRule& rule = {});

/// Returns the same, required: "Error on '…': missing ADVANCE".
[[nodiscard]] Result<double> RequiredFloat(const Command& line, const std::string& key,
                                           const NumberRule& rule = {});

[[nodiscard]] Result<std::string> RequiredText(const Command& line, const std::string& key);

/// Formats a number as Python does: 0.0, 1.5.
[[nodiscard]] std::string PythonNumber(double value);

/// Steps of a command before the next line of its script.
struct Outcome {
  Wait wait;                       ///< empty: nothing to wait for
  std::vector<std::string> lines;  ///< next lines to read
};

using Handler = Result<Outcome> (*)(VirtualKlipper&, const Command&);

/// Finds and runs a command. Unknown ones are reported as a response, without an error. Errors have
/// Klipper's wording.
[[nodiscard]] Result<Outcome> RunCommand(VirtualKlipper& machine, const Command& line);

/// One table per family of commands.
[[nodiscard]] const std::map<std::string, Handler>& MotionCommands();
[[nodiscard]] const std::map<std::string, Handler>& SettingCommands();
[[nodiscard]] const std::map<std::string, Handler>& HeatCommands();
[[nodiscard]] const std::map<std::string, Handler>& HostCommands();
[[nodiscard]] const std::map<std::string, Handler>& VariableCommands();
/// Only with a load cell.
[[nodiscard]] const std::map<std::string, Handler>& ProbeCommands();
/// Only with tools.
[[nodiscard]] const std::map<std::string, Handler>& ToolCommands();
/// Returns all tables of a machine, in lookup order.
[[nodiscard]] std::vector<const std::map<std::string, Handler>*> CommandTables(
    const VirtualKlipper& machine);

/// True if it is T0, T1, ... of an existing tool.
[[nodiscard]] bool IsToolChange(const VirtualKlipper& machine, const std::string& name);
[[nodiscard]] Result<Outcome> ChangeTool(VirtualKlipper& machine, const Command& line);

/// Waits until everything queued has been executed.
[[nodiscard]] Outcome WaitForMoves(VirtualKlipper& machine);

/// Queues a straight move to x, y, z, e; the wait is for room in the queue.
[[nodiscard]] Result<Outcome> MoveTo(VirtualKlipper& machine, const std::array<double, 4>& to_mm,
                                     double speed_mm_s);

}  // namespace trammel::sim
