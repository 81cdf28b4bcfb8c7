// The search along the break point: where a press explains the samples best, and how far from there
// it still explains them well enough.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "tap/contact/power_press.h"
#include "tap/contact/press_profile.h"
#include "tap/contact/two_zone_press.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// The sum of squares of a polynomial press (0 straight, 1 quadratic, 2 cubic); kNever where it
/// would start with a pull, which is no press.
[[nodiscard]] inline double SumSquares(const PressProfile::At& at, std::size_t model) {
  return at.start_slope[model] >= 0 ? at.sum_squares[model] : kNever;
}

/// Break points over the whole stretch, in order: at every sample of a slow converter, at every few
/// of a fast one.
using Scan = std::span<PressProfile::At>;
[[nodiscard]] Scan ScanSamples(const PressProfile& profile, Workspace& workspace);

/// Of the break's standard deviation, to which minima and borders are searched.
inline constexpr double kEnoughOfScale = 0.01;

struct Minimum {
  double t = std::numeric_limits<double>::quiet_NaN();
  double sum_squares = kNever;
};

/// The least of a scan, then between its neighbours by Brent's method (1973, chapter 5), to a
/// hundredth of the break's standard deviation: noise and slope set the tolerance, not the scan.
[[nodiscard]] Minimum FindMinimum(const PressProfile& profile, Scan scan, std::size_t model);

/// The place of a scan's least.
[[nodiscard]] std::size_t FindLeast(Scan scan, std::size_t model);

/// A function of the break point that outlives the call it is given to.
class OfBreak {
 public:
  template <class Function>
  OfBreak(const Function& function)  // NOLINT(google-explicit-constructor)
      : function_(&function),
        call_([](const void* f, double t) { return (*static_cast<const Function*>(f))(t); }) {}
  double operator()(double t) const { return call_(function_, t); }

 private:
  const void* function_;
  double (*call_)(const void*, double);
};

/// Brent's method between two points that lie higher than `middle`, or where there is nothing.
/// @param of         Sum of squares at a break point.
/// @param tolerance  From the least sum of squares so far.
[[nodiscard]] Minimum FindMinimum(const Minimum& left, const Minimum& middle, const Minimum& right,
                                  OfBreak of, OfBreak tolerance);

/// Standard deviation of the break at the end of a straight press of that slope, for noise of this
/// variance: the scale of every tolerance.
[[nodiscard]] double BreakScale(const PressProfile::At& at, std::size_t below, double variance);

/// Where a margin that is positive at `inside` falls through 0 on the way to `limit`, where it is
/// negative. Steps out from the inside by `scale` and more, then false position (Illinois) to a
/// hundredth of the scale.
template <class Margin>
[[nodiscard]] double FindBorder(double inside, double limit, double scale, const Margin& margin) {
  constexpr int kMostSteps = 60;
  double m_inside = margin(inside);
  double outside = limit;
  double m_outside = -kNever;
  for (double step = 2 * scale; step < 0.9 * std::abs(limit - inside); step *= 2) {
    const double t = limit > inside ? inside + step : inside - step;
    const double here = margin(t);
    if (!(here >= 0)) {
      outside = t;
      m_outside = here;
      break;
    }
    inside = t;
    m_inside = here;
  }
  double before = outside;
  for (int i = 0; i < kMostSteps && std::abs(outside - inside) > kEnoughOfScale * scale; ++i) {
    const bool halve = !std::isfinite(m_outside) || !(m_inside > m_outside);
    const double share = halve ? 0.5 : m_inside / (m_inside - m_outside);
    const double t = inside + (outside - inside) * share;
    const double here = margin(t);
    if (here >= 0) {
      inside = t;
      m_inside = here;
      m_outside *= 0.5;
    } else {
      outside = t;
      m_outside = here;
      m_inside *= 0.5;
    }
    if (!halve && std::abs(t - before) < 0.5 * kEnoughOfScale * scale) {
      return t;
    }
    before = t;
  }
  return inside;
}

enum Model : std::size_t { kLinear, kQuadratic, kCubic, kPower, kTwoZones, kModels };

/// From where, of the quadratic press's break, the press in two zones is looked for.
inline constexpr double kZonesFrom = 0.7;

/// Of the kinks that are tried: sharp, and rounded over a fifth of the outer zone up to all of it.
inline constexpr std::array<double, 6> kRoundings = {0, 0.2, 0.4, 0.6, 0.8, 1};

/// The best kinks for one break.
struct Kinks {
  std::array<double, kRoundings.size()> s{};  ///< Of each rounding,
  std::size_t best = 0;                       ///< and which of these explains the samples best.
};

/// A local minimum of the press in two zones along the break: a wide zone and a narrow one may both
/// explain the samples, and what lies between them not.
struct ZonesMode {
  Minimum least;
  Kinks kinks;  ///< At its break.
};

/// What the press in two zones costs beyond its sum of squares.
struct ZonesPrice {
  double curve = 0;     ///< A curve of the inner zone,
  double far = 0;       ///< a break so far beyond that of the quadratic press, per its depth,
  double smooth_t = 0;  ///< which is this.

  [[nodiscard]] double Far(double t) const { return far * std::max(0.0, t / smooth_t - 1); }
  [[nodiscard]] double Cost(const TwoZonePress& press) const;
  /// Of the best one with its break at t.
  /// @param near  Kinks for a break close by.
  [[nodiscard]] double Cost(const PressProfile& profile, double t, const Kinks& near) const;
  /// By how much that one costs less than is allowed; negative where it costs more. Where it costs
  /// less, the margin may be that of a worse one.
  [[nodiscard]] double Margin(const PressProfile& profile, double t, const Kinks& near,
                              double allowed) const;
};

/// The models' answers.
struct Candidates {
  std::array<Minimum, kModels> model;
  PowerPress power;
  std::array<ZonesMode, kZonesStarts.size()> modes;  ///< Of the press in two zones, by its start.
  TwoZonePress zones;  ///< At the break of the best mode, with a sharp kink.
  ZonesPrice price;
  double noise_variance = 0;  ///< Of a sample about the model that fits best; 0 without a press.
  double variance = 0;        ///< The same as it acts on means.
  double least = kNever;      ///< The sum of squares of the model that fits best.
  double freedom = 0;         ///< Samples less unknowns of the quadratic press.
  /// The samples ask for a start that no cubic press has: a toe, a thread, plastic. It is not known
  /// whether toe or press ends the contact, and the quadratic press's answer stays in question.
  bool flat_start = false;
  /// Besides, the cubic press explains them better than the other smooth ones: noise seldom does
  /// that, nor does a round tip.
  bool toe = false;

  [[nodiscard]] double Cost(std::size_t m) const { return model[m].sum_squares / variance; }
  /// Slope of the outer zone over the inner one's where two zones explain the samples much better
  /// than any smooth press; else 1.
  [[nodiscard]] double OuterRatio() const;
  /// Whether a break is near enough to the quadratic press's for its neighbours.
  [[nodiscard]] bool Near(double t) const;
};

/// @param scan       Of the profile.
/// @param inflation   By which correlation of the noise raises the variance of means; >= 1.
/// @param neighbours  Whether the power law and the press in two zones are asked too.
[[nodiscard]] Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation,
                                        bool neighbours = true);

}  // namespace trammel::tap
