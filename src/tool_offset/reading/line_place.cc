#include "tool_offset/reading/line_place.h"

#include <algorithm>
#include <cmath>

namespace trammel::tool_offset {

std::optional<LinePlace> HalfInkPlace(std::span<const float> ink, double low, double high) {
  // Sample i covers [i - 0.5, i + 0.5].
  if (!(low >= -0.5) || !(high <= static_cast<double>(ink.size()) - 0.5) || !(low < high)) {
    return std::nullopt;
  }
  const auto first = static_cast<std::size_t>(std::floor(low + 0.5));
  const std::size_t last =
      std::min(static_cast<std::size_t>(std::floor(high + 0.5)), ink.size() - 1);
  const auto part = [&](std::size_t i) {
    const double at = static_cast<double>(i);
    return std::min(high, at + 0.5) - std::max(low, at - 0.5);
  };
  double whole = 0;
  for (std::size_t i = first; i <= last; ++i) whole += part(i) * static_cast<double>(ink[i]);
  if (!(whole > 0)) return std::nullopt;
  double below = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const double here = part(i) * static_cast<double>(ink[i]);
    if (here > 0 && below + here >= whole / 2) {
      const double start = std::max(low, static_cast<double>(i) - 0.5);
      return LinePlace{start + (whole / 2 - below) / static_cast<double>(ink[i]), whole};
    }
    below += here;
  }
  return std::nullopt;
}

}  // namespace trammel::tool_offset
