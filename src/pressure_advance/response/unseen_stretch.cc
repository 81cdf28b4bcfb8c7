#include "pressure_advance/response/unseen_stretch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "base/statistics.h"
#include "pressure_advance/response/excess.h"

namespace trammel::pressure_advance {

std::string NameUnseenStretch(const std::vector<std::optional<double>>& frame_positions_mm,
                              const TransitionPlan& plan) {
  constexpr double kUsualSteps = 3;
  std::vector<double> seen;
  for (const std::optional<double>& position : frame_positions_mm) {
    if (position) seen.push_back(*position);
  }
  if (seen.size() < 2) return {};
  std::sort(seen.begin(), seen.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < seen.size(); ++i) steps.push_back(seen[i] - seen[i - 1]);
  const double usual_mm = kUsualSteps * Median(steps);
  for (const TransitionWindow* window : {&plan.acceleration, &plan.deceleration}) {
    const Interval& span = window->span;
    const double most_mm = std::max(usual_mm, kMostUnread * (span.hi - span.lo));
    double from = span.lo;
    for (std::size_t i = 0; i <= seen.size(); ++i) {
      const double to = i < seen.size() ? std::clamp(seen[i], span.lo, span.hi) : span.hi;
      if (to - from > most_mm) {
        return fmt::format("no frame shows the line from {:.3g} to {:.3g} mm", from, to);
      }
      from = std::max(from, to);
    }
  }
  return {};
}

}  // namespace trammel::pressure_advance
