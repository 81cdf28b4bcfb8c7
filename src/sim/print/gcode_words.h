// One G-code line taken apart: a command name and its parameters.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

/// A command such as {"G1", {{"X", "10"}}} or {"SET_VELOCITY_LIMIT", {{"ACCEL", "3000"}}}. Names
/// and keys are upper case; values are as written.
struct Command {
  int line = 0;      ///< from 1
  std::string name;  ///< empty on a line without a command
  std::map<std::string, std::string> parameters;

  [[nodiscard]] bool has(const std::string& key) const { return parameters.count(key) > 0; }
};

/// Drops comments, line numbers and checksums and splits the rest. Klipper's long commands take
/// KEY=VALUE, the others letters with numbers ("G1X10Y20" included). A line that is neither gives a
/// command whose name is its first word. Never fails: what cannot be read fails where it is used.
[[nodiscard]] Command ParseCommand(std::string_view line, int line_number);

/// A closed range of allowed values with the name of what it bounds.
struct Bound {
  double lo = 0;
  double hi = 0;
};

/// The number of a parameter; absent where the command does not have it. Fails on text that is not
/// a finite number and on a number out of bounds, naming line, key, value and bound.
[[nodiscard]] Result<std::optional<double>> NumberOf(const Command& command, const std::string& key,
                                                     const Bound& bound);

}  // namespace trammel::sim
