// One parsed line of G-code: a command's name and its parameters.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

/// Command such as {"G1", {{"X", "10"}}} or {"SET_VELOCITY_LIMIT", {{"ACCEL", "3000"}}}. Names and
/// keys are upper case; values are as written.
struct Command {
  int line = 0;      ///< from 1
  std::string text;  ///< as written, trimmed, without comment
  std::string name;  ///< empty on a line without a command
  std::map<std::string, std::string> parameters;
  std::string rest;   ///< everything after the name, as written
  std::string fault;  ///< not empty: the parameters could not be read

  [[nodiscard]] bool has(const std::string& key) const { return parameters.count(key) > 0; }
  /// The value of a parameter as written, or the fallback without it.
  [[nodiscard]] std::string text_of(const std::string& key,
                                    const std::string& fallback = "") const {
    const auto found = parameters.find(key);
    return found == parameters.end() ? fallback : found->second;
  }
};

/// Syntax of the parameters of G and M commands.
enum class Letters {
  kSingle,  ///< single letters with numbers, "G1X10Y20" and exponents included
  kRuns,    ///< runs of letters are keys, as in Klipper: "YQ" is one key without a value
};

/// Drops comments, line numbers and checksums and splits the rest. Long commands have KEY=VALUE.
/// Never fails: unreadable text is in `fault`, or fails where it is used.
[[nodiscard]] Command ParseCommand(std::string_view line, int line_number,
                                   Letters letters = Letters::kSingle);

/// Parses text as a finite number, with optional plus sign; absent otherwise.
[[nodiscard]] std::optional<double> ToNumber(std::string_view text);

/// Closed range of allowed values.
struct Bound {
  double lo = 0;
  double hi = 0;
};

/// Returns a parameter's number; absent if the command lacks it. Error (kInput): not a finite
/// number or out of bounds, with line, key, value and bound.
[[nodiscard]] Result<std::optional<double>> NumberOf(const Command& command, const std::string& key,
                                                     const Bound& bound);

}  // namespace trammel::sim
