#include "tap_miss_bound.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>

#include "base/statistics.h"
#include "tap_length_bound.h"

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

double MissBound::LeastHolding(double held_here) const {
  constexpr double kReach = 1e3;
  if (distance.empty()) return 0;
  const double missed = 1 - held_here;
  const double limit =
      Solve(missed, kReach, [&](double at) { return ShareBelow(at, -0.5, distance); });
  return 1 - ShareBelow(limit, 0.5, distance);
}

double MissBound::LeastWidening_um(double held_here) const {
  const double more = std::max(0.0, LeastHolding(held_here) - (1 - left_out));
  return 0.5 * more * std::max(0.0, apart_um - half_width_um);
}

bool MissBound::HiddenByNoise(double least_held, double held_here) const {
  return held >= least_held && LeastWidening_um(held_here) > kMostWidening * half_width_um;
}

bool MissBound::HiddenAmongOthers() const {
  return joint.least_um > (1 + kMostWidening) * joint.read_um;
}

namespace {

// Analyses a row's tap as it would be with a smooth press.
void AddSmooth(const TapRow& row, sim::SimulatedTap tap, const QuietTap& quiet,
               const SmoothPress& smooth, MissBound& bound, TapAnswers& answers) {
  constexpr double kLeastDistance = 1e-3;
  bound.distance.push_back(std::max(smooth.misfit, kLeastDistance));
  bound.apart_um += kUmPerMm * std::abs(smooth.shift_mm);
  for (std::size_t s = 0; s < smooth.force_g.size(); ++s) {
    tap.force_g[quiet.first + s] += smooth.force_g[s] - quiet.tap.force_g[quiet.first + s];
  }
  tap::TapOptions options;
  if (row.latency_known) options.latency_s = std::max(0.0, tap.latency_s);
  tap::TapAnalyser analyser(options);
  const std::vector<tap::Move> moves = MovesOf(tap);
  const tap::TapAnalysis analysis = analyser.Analyse({tap.time_s, tap.force_g, moves});
  const double contact_z_mm = tap.truth->contact_z_mm;
  Add(analysis, contact_z_mm + smooth.shift_mm, 0, answers);
  bound.left_out +=
      analysis.verdict == Verdict::kGood &&
      (analysis.interval95_mm.lo > contact_z_mm || analysis.interval95_mm.hi < contact_z_mm);
}

SmoothPress SmoothPressOf(const QuietTap& quiet, const SmoothPress& nearest, double excess) {
  return excess > 0 ? SmoothPressBeyond(quiet.Press(), nearest, excess) : nearest;
}

// On average over some phases of the sampling.
double JointHalfWidthUm(const TapRow& row, std::uint64_t first_seed, double excess,
                        double refused) {
  constexpr int kPhases = 2;
  std::vector<double> half_width_um;
  for (int i = 0; i < kPhases; ++i) {
    const QuietTap quiet = TakeQuietTap(row, first_seed + static_cast<std::uint64_t>(i));
    if (quiet.height_mm.empty()) continue;
    const SmoothPress smooth = SmoothPressOf(quiet, NearestSmoothPress(quiet.Press()), excess);
    if (smooth.force_g.empty()) continue;
    half_width_um.push_back(
        LeastHalfWidthUm({quiet.height_mm, smooth.force_g, quiet.noise_g}, kHeldJointly, refused));
  }
  return half_width_um.empty() ? 0 : Mean(half_width_um);
}

}  // namespace

MissBound BoundMisses(TapRow row, int taps, std::uint64_t first_seed, double least_held) {
  // Of the squares of the distances: a press that is farther off may be left out more often.
  constexpr double kExcess[] = {0, 0.5, 1, 2};
  MissBound bounds[std::size(kExcess)];
  TapAnswers answers[std::size(kExcess)];
  for (int i = 0; i < taps; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const QuietTap quiet = TakeQuietTap(row, seed);
    const sim::SimulatedTap tap = SimulateRow(row, seed);
    if (quiet.height_mm.empty() || tap.time_s != quiet.tap.time_s) continue;
    const SmoothPress nearest = NearestSmoothPress(quiet.Press());
    if (nearest.force_g.empty()) continue;
    for (std::size_t k = 0; k < std::size(kExcess); ++k) {
      AddSmooth(row, tap, quiet, SmoothPressOf(quiet, nearest, kExcess[k]), bounds[k], answers[k]);
    }
  }
  std::size_t most = 0;
  double longest = 0;
  for (std::size_t k = 0; k < std::size(kExcess); ++k) {
    MissBound& bound = bounds[k];
    bound.left_out /= taps;
    bound.apart_um /= std::max<double>(1, static_cast<double>(bound.distance.size()));
    bound.held = answers[k].Coverage();
    bound.half_width_um = answers[k].half_width_um.empty() ? 0 : Mean(answers[k].half_width_um);
    if (bound.LeastMissed(least_held) > bounds[most].LeastMissed(least_held)) most = k;
  }
  MissBound of_most = bounds[most];
  for (std::size_t k = 0; k < std::size(kExcess); ++k) {
    const MissBound& bound = bounds[k];
    if (bound.held < least_held) continue;
    const double joint_um =
        JointHalfWidthUm(row, first_seed, kExcess[k], answers[k].RefusedShare());
    if (joint_um > longest * bound.half_width_um) {
      longest = joint_um / bound.half_width_um;
      of_most.joint = {joint_um, bound.half_width_um};
    }
  }
  return of_most;
}

}  // namespace trammel
