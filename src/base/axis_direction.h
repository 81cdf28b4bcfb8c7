// Direction along an image or machine axis.
#pragma once

#include <optional>
#include <string_view>

namespace trammel {

enum class AxisDirection { kPlusX, kMinusX, kPlusY, kMinusY };

[[nodiscard]] constexpr bool AlongX(AxisDirection direction) {
  return direction == AxisDirection::kPlusX || direction == AxisDirection::kMinusX;
}

/// Returns 1 towards larger coordinates, -1 towards smaller ones.
[[nodiscard]] constexpr double Sign(AxisDirection direction) {
  return direction == AxisDirection::kPlusX || direction == AxisDirection::kPlusY ? 1 : -1;
}

/// Returns the spelling of files and settings: "+x", "-x", "+y" or "-y".
[[nodiscard]] std::string_view ToString(AxisDirection direction);
[[nodiscard]] std::optional<AxisDirection> ParseAxisDirection(std::string_view name);

}  // namespace trammel
