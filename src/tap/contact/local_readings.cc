#include "tap/contact/local_readings.h"

#include <algorithm>
#include <cmath>

#include "tap/contact/break_search.h"

namespace trammel::tap {
namespace {

struct Part {
  double press = 1;     // share of the press,
  double baseline = 1;  // and as much of the baseline, of the press's length
};
constexpr Part kParts[] = {{1, 0.5}, {0.5, 2}, {0.4, 0.4}, {0.25, 1}};
constexpr std::size_t kMinBelow = 8;
constexpr std::size_t kMinAbove = 6;
constexpr double kSignificant = 2.8;

// Computes the variance of the break for unit noise and slope: of the ends of a parabola and of a
// line.
double Variance(std::size_t below, std::size_t above) {
  return 9 / static_cast<double>(below) + 4 / static_cast<double>(above);
}

}  // namespace

LocalReadings ReadLocally(const BreakSamples& samples, double t, double noise, double inflation,
                          Workspace& workspace) {
  LocalReadings readings;
  const auto at = [&](double y) {
    return static_cast<std::size_t>(std::lower_bound(samples.y.begin(), samples.y.end(), y) -
                                    samples.y.begin());
  };
  const std::size_t middle = at(t);
  const double whole = Variance(middle, samples.y.size() - middle);
  for (const Part& part : kParts) {
    const std::size_t first = at(t * (1 - part.press));
    const std::size_t end = at(t * (1 + part.baseline));
    if (middle < first + kMinBelow || end < middle + kMinAbove) {
      continue;
    }
    const Workspace::Scope scope(workspace);
    const auto cut = [&](std::span<const double> all) {
      return all.empty() ? all : all.subspan(first, end - first);
    };
    const PressProfile profile({cut(samples.y), cut(samples.force), cut(samples.weight)},
                               workspace);
    const Scan scan = profile.Ready() ? ScanSamples(profile, workspace) : Scan{};
    if (scan.empty()) {
      continue;
    }
    const std::size_t best = FindLeast(scan, 1);
    if (best == 0 || best + 1 == scan.size()) {
      continue;
    }
    const double variance = std::max(0.1 * whole, Variance(middle - first, end - middle) - whole);
    const double force = 1.3 * noise * std::sqrt(inflation * variance);
    const Minimum found = FindMinimum(profile, scan, 1);
    if (!(found.sum_squares < kNever) || !(found.t > scan.front().t) ||
        !(found.t < scan.back().t)) {
      continue;
    }
    const PressProfile::At here = profile.Evaluate(found.t, profile.Below(found.t));
    const double slope = here.start_slope[0];
    if (!(slope > 0)) {
      continue;
    }
    const double deviation = force / slope;
    const double apart = found.t - t;
    if (std::abs(apart) > kSignificant * deviation) {
      const double beyond = std::abs(apart);
      (apart < 0 ? readings.below : readings.above) =
          std::max(apart < 0 ? readings.below : readings.above, beyond);
    }
  }
  return readings;
}

}  // namespace trammel::tap
