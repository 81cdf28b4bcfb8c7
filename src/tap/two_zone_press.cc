#include "tap/two_zone_press.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastPart = 3;  // samples of each zone
constexpr double kLeastRatio = 0.1;    // of the outer slope to the inner one
// Widths of the outer zone that are tried, of the depth; steps around the best, of its width, and
// by what they shrink where they lead nowhere.
constexpr std::array<double, 8> kWidths = {0.025, 0.05, 0.09, 0.15, 0.24, 0.36, 0.55, 0.8};
constexpr double kStep = 0.25;
constexpr double kShrink = 0.4;
constexpr int kMostSteps = 7;

class Kinks {
 public:
  Kinks(const PressProfile& profile, double t)
      : profile_(profile), below_(profile.Below(t)), outer_(profile.Outer(t, below_)) {}

  void Try(double width, TwoZonePress& best) const {
    const double s = outer_.t * (1 - width);
    const std::size_t below = profile_.Below(s);
    if (!(s < outer_.t) || below < kLeastPart || below_ < below + kLeastPart) {
      return;
    }
    const PressProfile::TwoZones at = profile_.EvaluateTwoZones(outer_, s, below);
    const double inner = at.outer_slope + at.added_slope;
    if (inner > 0 && at.outer_slope >= kLeastRatio * inner &&
        (!best.found || at.sum_squares_curved < best.sum_squares_curved)) {
      best = {
          outer_.t, s, at.outer_slope, inner, at.added_curve, at.sum_squares, at.sum_squares_curved,
          true};
    }
  }

 private:
  const PressProfile& profile_;
  std::size_t below_;
  PressProfile::OuterZone outer_;
};

}  // namespace

TwoZonePress FitTwoZones(const PressProfile& profile, double t) {
  const Kinks kinks(profile, t);
  TwoZonePress best;
  for (const double width : kWidths) {
    kinks.Try(width, best);
  }
  double step = kStep;
  for (int i = 0; best.found && i < kMostSteps; ++i) {
    const double centre = best.s;
    const double width = 1 - centre / t;
    kinks.Try(width * (1 - step), best);
    kinks.Try(width * (1 + step), best);
    step *= best.s == centre ? kShrink : 1;
  }
  return best;
}

namespace {

// Some steps of break and kink from a start, each in turn.
TwoZonePress Improve(const PressProfile& profile, TwoZonePress best) {
  constexpr int kSteps = 6;
  double step = kStep;
  for (int i = 0; best.found && i < kSteps; ++i) {
    const TwoZonePress centre = best;
    const double length = centre.t - centre.s;
    for (const double moved : {-step, step}) {
      const double t = centre.t + moved * length;
      Kinks(profile, t).Try((t - centre.s) / t, best);
      Kinks(profile, centre.t).Try((length + moved * length) / centre.t, best);
    }
    step *= best.sum_squares_curved < centre.sum_squares_curved ? 1 : kShrink;
  }
  return best;
}

}  // namespace

TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t) {
  // By how much of its width a zone ends beyond the smooth break: a stiff or a wide one near it, a
  // soft one behind.
  constexpr std::array<std::array<double, 2>, 2> kBeyond = {{{-0.15, 0}, {0.3, 0.8}}};
  TwoZonePress best;
  for (const std::array<double, 2>& kind : kBeyond) {
    TwoZonePress start;
    for (const double width : kWidths) {
      for (const double beyond : kind) {
        Kinks(profile, smooth_t * (1 + beyond * width)).Try(width, start);
      }
    }
    const TwoZonePress improved = Improve(profile, start);
    if (improved.found && (!best.found || improved.sum_squares_curved < best.sum_squares_curved)) {
      best = improved;
    }
  }
  return best;
}

}  // namespace trammel::tap
