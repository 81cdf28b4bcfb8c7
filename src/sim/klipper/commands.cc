// Parses numbers of commands, with Klipper's error messages.
#include "sim/klipper/commands.h"

#include <fmt/format.h>

#include <cmath>

namespace trammel::sim {

std::string PythonNumber(double value) {
  return value == std::floor(value) && std::abs(value) < 1e15 ? fmt::format("{:.1f}", value)
                                                              : fmt::format("{}", value);
}

Result<std::optional<double>> FloatOf(const Command& line, const std::string& key,
                                      const NumberRule& rule) {
  const auto found = line.parameters.find(key);
  if (found == line.parameters.end()) return std::optional<double>{};
  const std::optional<double> value = ToNumber(found->second);
  if (!value) {
    return Fail(fmt::format("Error on '{}': unable to parse {}", line.text, found->second));
  }
  if (rule.minimum && *value < *rule.minimum) {
    return Fail(fmt::format("Error on '{}': {} must have minimum of {}", line.text, key,
                            PythonNumber(*rule.minimum)));
  }
  if (rule.above && *value <= *rule.above) {
    return Fail(fmt::format("Error on '{}': {} must be above {}", line.text, key,
                            PythonNumber(*rule.above)));
  }
  if (rule.maximum && *value > *rule.maximum) {
    return Fail(fmt::format("Error on '{}': {} must have maximum of {}", line.text, key,
                            PythonNumber(*rule.maximum)));
  }
  return value;
}

Result<double> RequiredFloat(const Command& line, const std::string& key, const NumberRule& rule) {
  const auto value = TRY(FloatOf(line, key, rule));
  if (!value) return Fail(fmt::format("Error on '{}': missing {}", line.text, key));
  return *value;
}

Result<std::string> RequiredText(const Command& line, const std::string& key) {
  const auto found = line.parameters.find(key);
  if (found == line.parameters.end()) {
    return Fail(fmt::format("Error on '{}': missing {}", line.text, key));
  }
  return found->second;
}

}  // namespace trammel::sim
