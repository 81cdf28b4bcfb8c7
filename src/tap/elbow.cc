#include "tap/elbow.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

/// Sums over a stretch, of times and forces from its own middle.
struct Sums {
  double n = 0, t = 0, tt = 0, f = 0, tf = 0, ff = 0;
};

// Runs over a stretch in the frame of its own middle, where little cancels.
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
  // Four runs side by side, so that one addition need not wait for the one before it.
  Sums part[4];
  std::size_t i = first;
  for (; i + 4 <= end; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) {
      Add(part[k], samples.time_s[i + k] - frame.time_s, samples.force_g[i + k] - frame.force_g);
    }
  }
  for (; i < end; ++i) {
    Add(part[0], samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
  }
  Sums sum;
  for (const Sums& p : part) {
    sum.n += p.n, sum.t += p.t, sum.tt += p.tt, sum.f += p.f, sum.tf += p.tf, sum.ff += p.ff;
  }
  return sum;
}

}  // namespace

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
  // What rounding leaves of equal times must not pass for a spread.
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
  const Frame frame = MiddleOf(samples, first, end);
  const Sums total = Total(samples, first, end, frame);
  Sums left;
  for (std::size_t i = first; i + 1 < first + least; ++i) {
    Add(left, samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
  }
  std::size_t elbow = end;
  // What two lines explain of the force's sum of squares: the largest leaves the least. It is kept
  // as a fraction, for fractions are compared without dividing.
  double most_explained = -1;
  double most_divisor = 1;
  for (std::size_t i = first + least - 1; i + least < end; ++i) {
    Add(left, samples.time_s[i] - frame.time_s, samples.force_g[i] - frame.force_g);
    const Sums right = {total.n - left.n, total.t - left.t,   total.tt - left.tt,
                        total.f - left.f, total.tf - left.tf, 0};
    // A line explains (f^2 + (n tf - t f)^2 / (n tt - t^2)) / n.
    double left_spread = left.n * left.tt - left.t * left.t;
    double right_spread = right.n * right.tt - right.t * right.t;
    double left_cross = left.n * left.tf - left.t * left.f;
    double right_cross = right.n * right.tf - right.t * right.f;
    if (!(left_spread > 0)) {  // repeated times: a level without slope
      left_spread = 1, left_cross = 0;
    }
    if (!(right_spread > 0)) {
      right_spread = 1, right_cross = 0;
    }
    const double left_explained = left.f * left.f * left_spread + left_cross * left_cross;
    const double right_explained = right.f * right.f * right_spread + right_cross * right_cross;
    const double left_divisor = left.n * left_spread;
    const double right_divisor = right.n * right_spread;
    const double explained = left_explained * right_divisor + right_explained * left_divisor;
    const double divisor = left_divisor * right_divisor;
    if (explained * most_divisor > most_explained * divisor) {
      most_explained = explained;
      most_divisor = divisor;
      elbow = i + 1;
    }
  }
  return elbow;
}

Crossing Intersect(const LineFit& left, const LineFit& right) {
  const double slope = left.slope_g_s - right.slope_g_s;
  // From the middle between both centroids, where differences are small.
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
