#include "base/axis_direction.h"

#include <array>
#include <cstddef>

namespace trammel {

std::string_view ToString(AxisDirection direction) {
  constexpr std::array<std::string_view, 4> kNames{"+x", "-x", "+y", "-y"};
  return kNames.at(static_cast<std::size_t>(direction));
}

std::optional<AxisDirection> ParseAxisDirection(std::string_view name) {
  for (const AxisDirection direction : {AxisDirection::kPlusX, AxisDirection::kMinusX,
                                        AxisDirection::kPlusY, AxisDirection::kMinusY}) {
    if (ToString(direction) == name) return direction;
  }
  return std::nullopt;
}

}  // namespace trammel
