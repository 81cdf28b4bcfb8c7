// Numbers in JSON, which has neither NaN nor infinity.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace trammel::report {

/// Returns null if the value is not finite.
[[nodiscard]] inline nlohmann::ordered_json Number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

/// Returns null if the value is absent or not finite.
[[nodiscard]] inline nlohmann::ordered_json Number(const std::optional<double>& value) {
  return value ? Number(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace trammel::report
