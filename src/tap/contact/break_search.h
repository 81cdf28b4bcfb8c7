// Searches along the break point: for the press that explains the samples best, and for the
// distance up to which it explains them well enough.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "tap/contact/press_profile.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// Returns the sum of squares of a polynomial press (0 straight, 1 quadratic, 2 cubic); kNever if
/// it would start with a pull, which is no press.
[[nodiscard]] inline double SumSquares(const PressProfile::At& at, std::size_t model) {
  return at.start_slope[model] >= 0 ? at.sum_squares[model] : kNever;
}

/// Break points over the whole stretch, in order: at every sample of a slow converter, at every few
/// of a fast one.
using Scan = std::span<PressProfile::At>;
[[nodiscard]] Scan ScanSamples(const PressProfile& profile, Workspace& workspace);

/// Search tolerance of minima and borders, in standard deviations of the break.
inline constexpr double kEnoughOfScale = 0.01;

struct Minimum {
  double t = std::numeric_limits<double>::quiet_NaN();
  double sum_squares = kNever;
};

/// Finds the minimum of a scan, then between its neighbours by Brent's method (1973, chapter 5), to
/// a hundredth of the break's standard deviation: noise and slope set the tolerance, not the scan.
[[nodiscard]] Minimum FindMinimum(const PressProfile& profile, Scan scan, std::size_t model);

/// Returns the index of a scan's minimum.
[[nodiscard]] std::size_t FindLeast(Scan scan, std::size_t model);

/// Reference to a function of the break point, which must outlive the call.
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

/// Minimises by Brent's method between two points that are higher than `middle`, or undefined.
/// @param of         Sum of squares at a break point.
/// @param tolerance  From the lowest sum of squares so far.
[[nodiscard]] Minimum FindMinimum(const Minimum& left, const Minimum& middle, const Minimum& right,
                                  OfBreak of, OfBreak tolerance);

/// Computes the standard deviation of the break at the end of a straight press of that slope, for
/// noise of this variance: the scale of every tolerance.
[[nodiscard]] double BreakScale(const PressProfile::At& at, std::size_t below, double variance);

/// Finds where a margin, positive at `inside` and negative at `limit`, falls through 0. Steps out
/// from the inside by `scale` and more, then false position (Illinois) to a hundredth of the scale.
template <class Margin>
[[nodiscard]] double FindBorder(double inside, double limit, double scale, const Margin& margin) {
  constexpr int kMaxSteps = 60;
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
  for (int i = 0; i < kMaxSteps && std::abs(outside - inside) > kEnoughOfScale * scale; ++i) {
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

}  // namespace trammel::tap
