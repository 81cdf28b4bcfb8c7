#include "pressure_advance/response/cut_window.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.h"
#include "base/square.h"

namespace trammel::pressure_advance {

std::optional<CompletedWindow> CompleteWindow(std::span<const double> parts,
                                              std::span<const double> wholes, double part) {
  TRAMMEL_CHECK(parts.size() == wholes.size(), "{} and {}", parts.size(), wholes.size());
  if (parts.size() < kFewestWhole) return std::nullopt;
  const auto [least, most] = std::minmax_element(parts.begin(), parts.end());
  constexpr double kAlike = 0.25;  // of the range of the parts
  const double alike = kAlike * (std::max(*most, part) - std::min(*least, part));
  if (!(alike > 0)) return std::nullopt;
  double n = 0, squares = 0, sx = 0, sy = 0;
  std::vector<double> weights;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double weight = 1 / Square(1 + Square((parts[i] - part) / alike));
    weights.push_back(weight);
    n += weight;
    squares += weight * weight;
    sx += weight * parts[i];
    sy += weight * wholes[i];
  }
  const double mx = sx / n, my = sy / n;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    xx += weights[i] * Square(parts[i] - mx);
    xy += weights[i] * (parts[i] - mx) * (wholes[i] - my);
  }
  if (!(xx > 0)) return std::nullopt;
  CompletedWindow completed;
  completed.per_part = xy / xx;
  completed.value = my + completed.per_part * (part - mx);
  double rest = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    rest += weights[i] * Square(wholes[i] - my - completed.per_part * (parts[i] - mx));
  }
  const double lines = n * n / squares;  // how many the weighted ones are worth
  const double variance = rest / n * lines / std::max(1.0, lines - 2);
  completed.sigma = std::sqrt(variance * (1 + 1 / lines + n / lines * Square(part - mx) / xx));
  return completed;
}

}  // namespace trammel::pressure_advance
