#include "tap/kinked_press.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace trammel::tap {
namespace {

constexpr std::size_t kGrid = 20;
constexpr std::size_t kLeastPart = 4;  // samples of each of the three parts

void Try(const PressProfile& profile, double t, double s, KinkedPress& best) {
  if (!(s < t)) {
    return;
  }
  const std::size_t below_t = profile.Below(t);
  const std::size_t below_s = profile.Below(s);
  if (below_s < kLeastPart || below_t < below_s + kLeastPart ||
      below_t + kLeastPart > profile.samples().y.size()) {
    return;
  }
  const PressProfile::Kinked at = profile.EvaluateKinked(t, below_t, s, below_s);
  const double inner_slope = at.outer_slope + at.added_slope;
  if (at.outer_slope >= 0 && inner_slope >= 0 &&
      (!best.found || at.sum_squares < best.sum_squares)) {
    best = {true, t, s, at.outer_slope, inner_slope, at.sum_squares};
  }
}

}  // namespace

KinkedPress FitKinkedPress(const PressProfile& profile) {
  KinkedPress best;
  constexpr double kStep = 1.0 / kGrid;
  for (std::size_t i = 2; i < kGrid; ++i) {
    for (std::size_t j = 1; j < i; ++j) {
      Try(profile, kStep * static_cast<double>(i), kStep * static_cast<double>(j), best);
    }
  }
  constexpr double kEnough = 0.005;
  for (double step = kStep / 2; best.found && step > kEnough; step /= 2) {
    // Break and kink make up for each other, so that the way along their valley may be long.
    bool moved = true;
    for (std::size_t round = 0; moved && round < kGrid; ++round) {
      const KinkedPress centre = best;
      for (const int i : {-1, 0, 1}) {
        for (const int j : {-1, 0, 1}) {
          Try(profile, centre.t + i * step, centre.s + j * step, best);
        }
      }
      moved = best.sum_squares < centre.sum_squares;
    }
  }
  return best;
}

}  // namespace trammel::tap
