#include "support/lag_line.h"

#include <algorithm>
#include <cmath>

namespace trammel::testing {
namespace {

constexpr double kStep_s = 0.00025;

double SpeedAt(const LagLine& line, double s) {
  const double rise = line.slow_before * line.length_mm;
  const double fall = (1 - line.slow_after) * line.length_mm;
  if (s < rise || s >= fall) return line.slow_mm_s;
  const double up = 2 * line.acceleration_mm_s2 * (s - rise);
  const double down = 2 * line.acceleration_mm_s2 * (fall - s);
  const double slow2 = line.slow_mm_s * line.slow_mm_s;
  return std::min(line.fast_mm_s, std::sqrt(slow2 + std::min(up, down)));
}

double Outflow(const LagModelTruth& law, double stored) {
  if (law.power == 0) return stored / law.linear_s;
  double lo = 0;
  double hi = 4000;
  for (int i = 0; i < 40; ++i) {
    const double middle = (lo + hi) / 2;
    (law.Stored(middle) < stored ? lo : hi) = middle;
  }
  return (lo + hi) / 2;
}

struct Commanded {
  std::vector<double> at;        // position on the line
  std::vector<double> filament;  // with pressure advance, before smoothing
};

Commanded Drive(const LagLine& line, double pressure_advance_s) {
  // Steady at the slow speed before the line begins, so that only the two transitions are left.
  constexpr int kLead = 400;
  Commanded commanded;
  for (int i = 0; i < kLead; ++i) {
    const double s = (i - kLead) * kStep_s * line.slow_mm_s;
    commanded.at.push_back(s);
    commanded.filament.push_back(s + pressure_advance_s * line.slow_mm_s);
  }
  double s = 0;
  double e = 0;
  while (s < line.length_mm + 2) {
    const double v = SpeedAt(line, s);
    commanded.at.push_back(s);
    commanded.filament.push_back(e + pressure_advance_s * v);
    const double middle = SpeedAt(line, s + v * kStep_s / 2);
    s += middle * kStep_s;
    e += middle * kStep_s * (1 - line.flow_loss_when_fast * middle / line.fast_mm_s);
  }
  return commanded;
}

// Running mean over `taps` values; the ends are held.
std::vector<double> Box(const std::vector<double>& values, int first, int taps) {
  const int last = static_cast<int>(values.size()) - 1;
  const auto at = [&](int i) { return values[std::clamp(i, 0, last)]; };
  std::vector<double> mean(values.size());
  double sum = 0;
  for (int k = 0; k < taps; ++k) sum += at(first + k);
  for (int i = 0; i <= last; ++i) {
    mean[i] = sum / taps;
    sum += at(i + first + taps) - at(i + first);
  }
  return mean;
}

// A triangle of 2 half + 1 taps is a box of half + 1 taps, twice.
std::vector<double> Smooth(const std::vector<double>& filament, int half) {
  return Box(Box(filament, -half, half + 1), 0, half + 1);
}

}  // namespace

double LagModelTruth::Stored(double q) const {
  return linear_s * q + (power > 0 ? power * std::pow(q, exponent) : 0);
}

double LagModelTruth::Secant(double slow, double fast) const {
  return (Stored(fast) - Stored(slow)) / (fast - slow);
}

std::vector<double> PrintLagLine(const LagLine& line, const LagModelTruth& law,
                                 double pressure_advance_s) {
  const Commanded commanded = Drive(line, pressure_advance_s);
  const int half = static_cast<int>(std::lround(line.smooth_time_s / 2 / kStep_s));
  const std::vector<double> driven = Smooth(commanded.filament, half);
  const int bins = static_cast<int>(line.length_mm / line.step_mm) + 1;
  std::vector<double> area(bins, 0.0);
  double stored = law.Stored(line.slow_mm_s);
  const int last = static_cast<int>(driven.size()) - half;
  for (int i = half + 1; i < last; ++i) {
    stored += driven[i] - driven[i - 1];
    const double out = stored > 0 ? std::min(stored, Outflow(law, stored) * kStep_s) : 0;
    stored -= out;
    if (stored < 0 && line.negative_flow_is_lost) {
      stored *= std::exp(-kStep_s / std::max(1e-3, law.Secant(0.1, line.slow_mm_s)));
    }
    // Spread over the nozzle's footprint.
    const double lo = (commanded.at[i] - line.footprint_mm / 2) / line.step_mm + 0.5;
    const double hi = (commanded.at[i] + line.footprint_mm / 2) / line.step_mm + 0.5;
    for (int b = static_cast<int>(std::floor(lo)); b <= static_cast<int>(std::floor(hi)); ++b) {
      if (b < 0 || b >= bins) continue;
      const double share = (std::min(hi, b + 1.0) - std::max(lo, double(b))) / (hi - lo);
      area[b] += out * share / line.step_mm;
    }
  }
  return area;
}

}  // namespace trammel::testing
