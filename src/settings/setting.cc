#include "settings/setting.h"

#include <fmt/format.h>

namespace trammel::settings {

std::optional<std::string> FindValueProblem(const SettingRange& range, double value) {
  if (value >= range.lo && value <= range.hi) return std::nullopt;  // false for NaN
  const std::string unit = range.unit.empty() ? "" : fmt::format(" {}", range.unit);
  return fmt::format("{}{} is outside {:.10g} ... {:.10g}{}", value, unit, range.lo, range.hi,
                     unit);
}

std::optional<std::string> FindValueProblem(const SettingRange& range, int value) {
  return FindValueProblem(range, static_cast<double>(value));
}

std::optional<std::string> FindValueProblem(const SettingRange& range,
                                            const std::optional<double>& value) {
  return value ? FindValueProblem(range, *value) : std::nullopt;
}

std::optional<std::string> FindValueProblem(const SettingRange& range,
                                            const std::vector<double>& values) {
  for (const double value : values) {
    if (auto problem = FindValueProblem(range, value)) return problem;
  }
  return std::nullopt;
}

std::optional<std::string> FindValueProblem(const SettingRange& range,
                                            const std::vector<int>& values) {
  for (const int value : values) {
    if (auto problem = FindValueProblem(range, value)) return problem;
  }
  return std::nullopt;
}

std::optional<std::string> FindValueProblem(const SettingRange& /*range*/,
                                            const std::string& text) {
  constexpr std::size_t kMaxBytes = 65536;
  if (text.size() > kMaxBytes) {
    return fmt::format("{} bytes are more than {}", text.size(), kMaxBytes);
  }
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if ((code < 0x20 && c != '\n' && c != '\t' && c != '\r') || code == 0x7f) {
      return fmt::format("holds the control character 0x{:02x}", code);
    }
  }
  return std::nullopt;
}

}  // namespace trammel::settings
