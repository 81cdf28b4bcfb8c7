#include "tap/contact/break_search.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

// Minimum samples on either side of a break point: the press has three unknowns.
constexpr std::size_t kMinBelow = 5;
constexpr std::size_t kMinAbove = 4;
constexpr double kUnknowns = 5;     // quadratic press, including the break
constexpr double kRounding = 1e-9;  // of the stretch: resolution of the sums of squares

// Brent's state: x the best point, w the second best, v the one before.
struct Brent {
  Minimum x, w, v;
  double a = 0;  // the bracket
  double b = 0;
  double step = 0;  // the last one, and the one before
  double before = 0;
  bool by_parabola = false;  // the last one

  // True if the parabola through the three has its minimum at the best point: no other trial pays.
  [[nodiscard]] bool AtVertex(double tolerance) const {
    constexpr double kNearVertex = 0.3;
    return by_parabola && std::abs(step) < kNearVertex * tolerance;
  }

  // Computes the next trial by a parabola through the three if reliable, else by golden section.
  [[nodiscard]] double Next(double tolerance) {
    constexpr double kGolden = 0.381966;
    const double r = (x.t - w.t) * (x.sum_squares - v.sum_squares);
    const double q = (x.t - v.t) * (x.sum_squares - w.sum_squares);
    const double p = (x.t - v.t) * q - (x.t - w.t) * r;
    const double to_vertex = -p / (2 * (q - r));
    const bool trusted = std::isfinite(to_vertex) && std::abs(to_vertex) < 0.5 * std::abs(before) &&
                         x.t + to_vertex > a && x.t + to_vertex < b;
    const double room = x.t < 0.5 * (a + b) ? b - x.t : a - x.t;
    before = trusted ? step : room;
    step = trusted ? to_vertex : kGolden * room;
    by_parabola = trusted;
    const double least = std::copysign(tolerance, trusted ? step : room);
    return x.t + (std::abs(step) >= tolerance ? step : least);
  }
  void Take(const Minimum& u) {
    if (u.sum_squares <= x.sum_squares) {
      (u.t < x.t ? b : a) = x.t;
      v = w;
      w = x;
      x = u;
      return;
    }
    (u.t < x.t ? a : b) = u.t;
    if (u.sum_squares <= w.sum_squares) {
      v = w;
      w = u;
    } else if (u.sum_squares <= v.sum_squares) {
      v = u;
    }
  }
};

}  // namespace

double BreakScale(const PressProfile::At& at, std::size_t below, double variance) {
  const double slope = std::abs(at.start_slope[0]);
  const double n = static_cast<double>(std::max<std::size_t>(below, 1));
  return slope > 0 ? std::max(3 * std::sqrt(variance / n) / slope, kRounding) : 1;
}

Scan ScanSamples(const PressProfile& profile, Workspace& workspace) {
  constexpr std::size_t kMax = 32;
  const std::span<const double> y = profile.samples().y;
  if (y.size() < kMinBelow + kMinAbove + 1) {
    return {};
  }
  const std::size_t range = y.size() - kMinBelow - kMinAbove;
  const std::size_t step = (range + kMax - 1) / kMax;
  const Scan scan = workspace.Take<PressProfile::At>((range + step - 1) / step);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const std::size_t below = kMinBelow + i * step;
    scan[i] = profile.Evaluate(y[below], below);
  }
  return scan;
}

std::size_t FindLeast(Scan scan, std::size_t model) {
  std::size_t best = 0;
  double least = kNever;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double cost = SumSquares(scan[i], model);
    if (cost < least) {
      best = i;
      least = cost;
    }
  }
  return best;
}

Minimum FindMinimum(const PressProfile& profile, Scan scan, std::size_t model) {
  const std::size_t best = FindLeast(scan, model);
  const auto of = [model](const PressProfile::At& at) {
    return Minimum{at.t, SumSquares(at, model)};
  };
  const Minimum middle = of(scan[best]);
  if (middle.sum_squares == kNever || best == 0 || best + 1 == scan.size()) {
    return middle;
  }
  const double freedom = std::max(1.0, profile.Totals()[0] - kUnknowns);
  const std::size_t below = profile.Below(middle.t);
  return FindMinimum(
      of(scan[best - 1]), middle, of(scan[best + 1]),
      [&](double t) { return SumSquares(profile.Evaluate(t, profile.Below(t)), model); },
      [&](double least) {
        return kEnoughOfScale * BreakScale(scan[best], below, least / freedom);
      });
}

Minimum FindMinimum(const Minimum& left, const Minimum& middle, const Minimum& right, OfBreak of,
                    OfBreak tolerance_at) {
  Brent brent;
  brent.x = middle;
  brent.w = left;
  brent.v = right;
  brent.a = left.t;
  brent.b = right.t;
  if (brent.v.sum_squares < brent.w.sum_squares) {
    std::swap(brent.w, brent.v);
  }
  brent.step = brent.before = brent.b - brent.a;
  constexpr int kMaxSteps = 60;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double tolerance = tolerance_at(brent.x.sum_squares);
    const double centre = 0.5 * (brent.a + brent.b);
    if (std::abs(brent.x.t - centre) <= 2 * tolerance - 0.5 * (brent.b - brent.a)) {
      break;
    }
    const double t = brent.Next(tolerance);
    // Brent's own criterion also requires a point on either side.
    constexpr int kMinSteps = 2;
    if (step >= kMinSteps && brent.AtVertex(tolerance)) {
      break;
    }
    brent.Take({t, of(t)});
  }
  return brent.x;
}

}  // namespace trammel::tap
