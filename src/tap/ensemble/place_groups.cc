#include "tap/ensemble/place_groups.h"

#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace trammel::tap {
namespace {

/// The square of taps whose place is not known.
constexpr double kNowhere = -1e300;

using Group = std::vector<std::size_t>;

bool SamePlace(const TapResult& a, const TapResult& b, double same_place_mm) {
  const bool a_known = std::isfinite(a.x_mm) && std::isfinite(a.y_mm);
  const bool b_known = std::isfinite(b.x_mm) && std::isfinite(b.y_mm);
  if (!a_known || !b_known) return a_known == b_known;
  return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) <= same_place_mm;
}

}  // namespace

/// The bed in squares of same_place_mm, so that only neighbours are compared.
std::vector<Group> GroupByPlace(std::span<const TapResult> taps, double same_place_mm) {
  std::vector<Group> groups;
  std::map<std::pair<double, double>, std::vector<std::size_t>> in_square;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (!taps[i].good) continue;
    const bool known = std::isfinite(taps[i].x_mm) && std::isfinite(taps[i].y_mm);
    const double column = known ? std::floor(taps[i].x_mm / same_place_mm) : kNowhere;
    const double row = known ? std::floor(taps[i].y_mm / same_place_mm) : kNowhere;
    std::optional<std::size_t> found;
    for (int side = 0; side < 9 && !found; ++side) {
      const auto square = in_square.find({column + side % 3 - 1, row + side / 3 - 1});
      if (square == in_square.end()) continue;
      for (const std::size_t group : square->second) {
        if (SamePlace(taps[groups[group].front()], taps[i], same_place_mm)) found = group;
      }
    }
    if (found) {
      groups[*found].push_back(i);
    } else {
      in_square[{column, row}].push_back(groups.size());
      groups.push_back({i});
    }
  }
  return groups;
}

}  // namespace trammel::tap
