#include "tap/two_zone_press.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastPart = 3;  // samples of each zone
constexpr double kLeastRatio = 0.1;    // of the outer slope to the inner one
// Widths of the outer zone that are tried, of the depth; between them by a parabola.
constexpr std::array<double, 7> kWidths = {0.03, 0.06, 0.1, 0.16, 0.25, 0.38, 0.55};

void Try(const PressProfile& profile, double t, std::size_t below_t, double width,
         TwoZonePress& best) {
  const double s = t * (1 - width);
  const std::size_t below_s = profile.Below(s);
  if (!(s < t) || below_s < kLeastPart || below_t < below_s + kLeastPart) {
    return;
  }
  const PressProfile::TwoZones at = profile.EvaluateTwoZones(t, below_t, s, below_s);
  const double inner = at.outer_slope + at.added_slope;
  if (!(inner > 0) || !(at.outer_slope >= kLeastRatio * inner)) {
    return;
  }
  if (!best.found || at.sum_squares_curved < best.sum_squares_curved) {
    best = {t,   s, at.outer_slope, inner, at.added_curve, at.sum_squares, at.sum_squares_curved,
            true};
  }
}

}  // namespace

TwoZonePress FitTwoZones(const PressProfile& profile, double t) {
  const std::size_t below_t = profile.Below(t);
  TwoZonePress best;
  double at = 0;
  double step = 1;
  for (std::size_t i = 0; i < kWidths.size(); ++i) {
    const double before = best.sum_squares_curved;
    const bool found = best.found;
    Try(profile, t, below_t, kWidths[i], best);
    if (best.found && (!found || best.sum_squares_curved < before)) {
      at = kWidths[i];
      step = 0.2 * at;
    }
  }
  if (!best.found) {
    return best;
  }
  for (int round = 0; round < 8; ++round) {
    const double centre = 1 - best.s / t;
    Try(profile, t, below_t, centre - step, best);
    Try(profile, t, below_t, centre + step, best);
    if (1 - best.s / t == centre) step *= 0.5;
  }
  return best;
}

}  // namespace trammel::tap
