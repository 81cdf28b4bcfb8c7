// A line of G-code taken apart as Klipper does, with Klipper's words for what is wrong with it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

struct CommandLine {
  std::string text;                               ///< as written, without comment and outer blanks
  std::string name;                               ///< upper case; empty on a line without a command
  std::map<std::string, std::string> parameters;  ///< keys upper case
  std::string rest;                               ///< everything after the name, as written
  std::string fault;                              ///< not empty: the parameters could not be read

  [[nodiscard]] bool has(const std::string& key) const { return parameters.count(key) > 0; }
};

/// Never fails; what cannot be read is told by `fault`.
[[nodiscard]] CommandLine ParseCommandLine(std::string_view line);

/// What a number must keep to.
struct NumberRule {
  std::optional<double> minimum;
  std::optional<double> above;
  std::optional<double> maximum;
};

/// A finite number of a long command or a parameter letter; absent where it is not given. The error
/// is Klipper's: "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have minimum of 0.0".
[[nodiscard]] Result<std::optional<double>> FloatOf(const CommandLine& line, const std::string& key,
                                                    const NumberRule& rule = {});

/// The same, required: "Error on '…': missing ADVANCE".
[[nodiscard]] Result<double> RequiredFloat(const CommandLine& line, const std::string& key,
                                           const NumberRule& rule = {});

[[nodiscard]] Result<std::string> RequiredText(const CommandLine& line, const std::string& key);

/// Text to a finite number; absent where it is none.
[[nodiscard]] std::optional<double> ToNumber(std::string_view text);

/// A number as Python prints it: 0.0, 1.5.
[[nodiscard]] std::string PythonNumber(double value);

}  // namespace trammel::sim
