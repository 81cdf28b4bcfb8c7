#include "tap_miss_bound.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace trammel {
namespace {

// Where a function that rises reaches a value.
template <class Function>
double Solve(double value, double reach, const Function& of) {
  constexpr double kEnough = 1e-9;
  double lo = -reach;
  double hi = reach;
  while (hi - lo > kEnough) {
    const double middle = 0.5 * (lo + hi);
    (of(middle) < value ? lo : hi) = middle;
  }
  return 0.5 * (lo + hi);
}

// Mean share of the taps whose ratio of densities has a logarithm below `limit`: on the smooth
// press with a half, on the row's with minus a half as `side`.
double ShareBelow(double limit, double side, std::span<const double> distance) {
  double sum = 0;
  for (const double d : distance) sum += NormalShare(limit / d + side * d);
  return sum / static_cast<double>(distance.size());
}

}  // namespace

double NormalShare(double deviations) { return 0.5 * std::erfc(-deviations / std::numbers::sqrt2); }

double NormalQuantile(double share) { return Solve(share, 6, NormalShare); }

double MissBound::LeastMissed(double least_held) const {
  constexpr double kReach = 1e3;
  const double p = std::min(left_out, kMostLeftOut);
  if (held < least_held || distance.empty() || p == 0) return 0;
  const double limit = Solve(p, kReach, [&](double at) { return ShareBelow(at, 0.5, distance); });
  return ShareBelow(limit, -0.5, distance);
}

MissBound BoundMisses(TapRow row, int taps, std::uint64_t first_seed) {
  constexpr double kLeastDistance = 1e-3;
  MissBound bound;
  int good = 0;
  int held = 0;
  int left_out = 0;
  for (int i = 0; i < taps; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const QuietTap quiet = TakeQuietTap(row, seed);
    const SmoothPress smooth = quiet.Nearest();
    sim::SimulatedTap tap = SimulateRow(row, seed);
    if (smooth.force_g.empty() || tap.time_s.size() != quiet.tap.time_s.size()) continue;
    bound.distance.push_back(std::max(smooth.misfit, kLeastDistance));
    for (std::size_t s = 0; s < smooth.force_g.size(); ++s) {
      tap.force_g[quiet.first + s] += smooth.force_g[s] - quiet.tap.force_g[quiet.first + s];
    }
    tap::TapOptions options;
    if (row.latency_known) options.latency_s = std::max(0.0, tap.latency_s);
    tap::TapAnalyser analyser(options);
    const std::vector<tap::Move> moves = MovesOf(tap);
    const tap::TapAnalysis analysis = analyser.Analyse({tap.time_s, tap.force_g, moves});
    if (analysis.verdict != Verdict::kGood) continue;
    const auto holds = [&](double z_mm) {
      return analysis.interval95_mm.lo <= z_mm && z_mm <= analysis.interval95_mm.hi;
    };
    const double contact_z_mm = tap.truth->contact_z_mm;
    ++good;
    held += holds(contact_z_mm + smooth.shift_mm);
    left_out += !holds(contact_z_mm);
    bound.half_width_um += kUmPerMm * 0.5 * (analysis.interval95_mm.hi - analysis.interval95_mm.lo);
  }
  bound.held = held / std::max(1.0, static_cast<double>(good));
  bound.left_out = left_out / static_cast<double>(taps);
  bound.half_width_um /= std::max(1, good);
  return bound;
}

}  // namespace trammel
