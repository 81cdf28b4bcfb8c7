#include "tap/samples/line_fit.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {

namespace {

/// Sums over a stretch, of times and forces relative to its own middle.
struct Sums {
  double n = 0, t = 0, tt = 0, f = 0, tf = 0, ff = 0;
};

// Frame of a stretch's own middle, with little cancellation.
struct Frame {
  double time_s;
  double force_g;
};

Frame MiddleOf(const Samples& samples, std::size_t first, std::size_t end) {
  const std::size_t middle = (first + end) / 2;
  return {samples.time_s[middle], samples.force_g[middle]};
}

void Add(Sums& sums, double t, double f) {
  sums.n += 1;
  sums.t += t;
  sums.tt += t * t;
  sums.f += f;
  sums.tf += t * f;
  sums.ff += f * f;
}

Sums Total(const Samples& samples, std::size_t first, std::size_t end, const Frame& frame) {
  Sums sum;
  for (std::size_t i = first; i < end; ++i) {
    Add(sum, samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
  }
  return sum;
}

// Minimum spread: below the difference of any two times in single precision. Repeated times have no
// spread, a cross sum of rounding only, and so a level without slope.
constexpr double kMinSpread_s2 = 1e-18;

struct Whole {
  double n, tt, tf;
};

// Computes the part of the force's sum of squares that two lines explain; the best split has the
// most. A line explains (f^2 + (n tf - t f)^2 / (n tt - t^2)) / n; both together over one divisor.
double Explained(const Sums& left, const Whole& whole) {
  const double n = left.n;
  const double m = whole.n - n;
  const double tt = left.t * left.t;
  const double tf = left.t * left.f;
  const double ff = left.f * left.f;
  const double left_cross = n * left.tf - tf;
  const double right_cross = m * (whole.tf - left.tf) - tf;
  const double a = std::max(n * left.tt - tt, kMinSpread_s2);
  const double b = std::max(m * (whole.tt - left.tt) - tt, kMinSpread_s2);
  const double na = n * a;
  const double mb = m * b;
  return (left_cross * left_cross * mb + right_cross * right_cross * na + ff * whole.n * (a * b)) /
         (na * mb);
}

}  // namespace

std::size_t IndexAt(std::span<const float> time_s, double at_s) {
  const auto found = std::lower_bound(time_s.begin(), time_s.end(), static_cast<float>(at_s));
  return static_cast<std::size_t>(found - time_s.begin());
}

double LineFit::Noise() const {
  return count > 2 ? std::sqrt(residual_g2 / static_cast<double>(count - 2)) : 0;
}

LineFit FitLine(const Samples& samples, std::size_t first, std::size_t end) {
  LineFit line;
  if (first >= end) {
    return line;
  }
  const Frame frame = MiddleOf(samples, first, end);
  const Sums sum = Total(samples, first, end, frame);
  line.count = end - first;
  line.mean_time_s = frame.time_s + sum.t / sum.n;
  line.mean_force_g = frame.force_g + sum.f / sum.n;
  line.time_spread_s2 = std::max(0.0, sum.tt - sum.t * sum.t / sum.n);
  // A spread of equal times is rounding.
  const bool has_slope = line.time_spread_s2 > 1e-12 * sum.tt && line.time_spread_s2 > 0;
  const double cross = sum.tf - sum.t * sum.f / sum.n;
  line.slope_g_s = has_slope ? cross / line.time_spread_s2 : 0;
  line.residual_g2 = std::max(0.0, sum.ff - sum.f * sum.f / sum.n - line.slope_g_s * cross);
  return line;
}

std::size_t FindElbow(const Samples& samples, std::size_t first, std::size_t end,
                      std::size_t least) {
  if (end < first + 2 * least) {
    return end;
  }
  Frame frame = MiddleOf(samples, first, end);
  const Sums raw = Total(samples, first, end, frame);
  frame.time_s += raw.t / raw.n;
  frame.force_g += raw.f / raw.n;
  // Relative to their means: the sums of times and of forces are 0, and those of the right line are
  // the negatives of the left one's.
  const Whole whole = {raw.n, raw.tt - raw.t * raw.t / raw.n, raw.tf - raw.t * raw.f / raw.n};
  Sums left;
  std::size_t i = first;
  for (; i + 1 < first + least; ++i) {
    Add(left, samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
  }
  std::size_t elbow = end;
  double most = -1;
  for (; i + least < end; ++i) {
    Add(left, samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
    const double explained = Explained(left, whole);
    if (explained > most) {
      most = explained;
      elbow = i + 1;
    }
  }
  return elbow;
}

double Student95(double freedom) {
  constexpr double z = 1.959964;
  constexpr double z3 = z * z * z;
  constexpr double z5 = z3 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96 * freedom * freedom);
}

Crossing Intersect(const LineFit& left, const LineFit& right) {
  const double slope = left.slope_g_s - right.slope_g_s;
  // Computes from the middle between both centroids, where differences are small.
  const double origin = 0.5 * (left.mean_time_s + right.mean_time_s);
  Crossing crossing;
  crossing.time_s = origin + (right.Force(origin) - left.Force(origin)) / slope;
  crossing.force_g = right.Force(crossing.time_s);
  double variance_g2 = 0;
  for (const LineFit* line : {&left, &right}) {
    const double reach = crossing.time_s - line->mean_time_s;
    const double noise = line->Noise();
    variance_g2 += noise * noise *
                   (1.0 / static_cast<double>(std::max<std::size_t>(line->count, 1)) +
                    (line->time_spread_s2 > 0 ? reach * reach / line->time_spread_s2 : 0));
  }
  crossing.standard_uncertainty_s = std::sqrt(variance_g2) / std::abs(slope);
  return crossing;
}

}  // namespace trammel::tap
