#include "tap/ensemble/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

/// Minimum deviation of a machine: below a nanometre the same tap was given several times.
constexpr double kMinDeviation_mm = 1e-6;

/// Pooled sum of squares, and its reduction, with a degree of freedom, when one tap is excluded.
struct Spread {
  double sum = 0;
  double freedom = 0;
  std::vector<double> without;

  [[nodiscard]] double Deviation() const { return std::sqrt(sum / freedom); }
};

/// Used heights of a series by place.
struct Heights {
  std::vector<std::vector<double>> places;
  std::vector<double> rest;  ///< all taps, less the mean of the place
};

Heights HeightsOf(const TapSeries& series, std::span<const TapResult> usable) {
  Heights heights;
  for (const auto& group : GroupByPlace(usable)) {
    if (group.size() < 2) continue;
    std::vector<double>& place = heights.places.emplace_back();
    for (const std::size_t i : group) place.push_back(series.taps[i].z_mm.quantity().value);
    const double mean = Mean(place);
    for (const double z_mm : place) heights.rest.push_back(z_mm - mean);
  }
  return heights;
}

Spread AboutMeans(const Heights& heights) {
  Spread spread;
  auto rest = heights.rest.begin();
  for (const auto& place : heights.places) {
    const auto count = static_cast<double>(place.size());
    for (std::size_t i = 0; i < place.size(); ++i, ++rest) {
      spread.sum += *rest * *rest;
      spread.without.push_back(count / (count - 1) * *rest * *rest);
    }
    spread.freedom += count - 1;
  }
  return spread;
}

/// Computes the standard uncertainty of the logarithm of a square's root, excluding one tap at a
/// time.
double Jackknife(std::size_t taps, const std::function<double(std::size_t)>& square_without) {
  std::vector<double> logs;
  for (std::size_t i = 0; i < taps; ++i) {
    const double one = std::log(square_without(i)) / 2;
    if (std::isfinite(one)) logs.push_back(one);
  }
  const auto count = static_cast<double>(logs.size());
  return count < 2 ? 0 : StandardDeviation(logs) * (count - 1) / std::sqrt(count);
}

double LogUncertainty(const Spread& spread) {
  const double by_taps = Jackknife(spread.without.size(), [&spread](std::size_t i) {
    return (spread.sum - spread.without[i]) / (spread.freedom - 1);
  });
  return std::max(1 / std::sqrt(2 * spread.freedom), by_taps);
}

/// Returns a positive quantity whose logarithm has a symmetric interval.
Measured LogNormal(double value, double half_width, double student95) {
  return Measured::Good({value,
                         value * half_width / student95,
                         {value * std::exp(-half_width), value * std::exp(half_width)}});
}

Measured DeviationOf(const Spread& spread) {
  const double t = StudentT95(spread.freedom);
  return LogNormal(spread.Deviation(), t * LogUncertainty(spread), t);
}

Measured RatioOfSameTaps(const Heights& a, const Heights& b, const Spread& of_a,
                         const Spread& of_b) {
  double products = 0;
  for (std::size_t i = 0; i < a.rest.size(); ++i) products += a.rest[i] * b.rest[i];
  const double freedom = of_a.freedom;
  const double t = StudentT95(freedom - 1);
  const double alone = std::max(0.0, 1 - products * products / (of_a.sum * of_b.sum));
  const double by_form = std::acosh(1 + 2 * alone * t * t / (freedom - 1)) / 2;
  const double by_taps = Jackknife(of_a.without.size(), [&](std::size_t i) {
    return (of_a.sum - of_a.without[i]) / (of_b.sum - of_b.without[i]);
  });
  return LogNormal(of_a.Deviation() / of_b.Deviation(), std::max(by_form, t * by_taps), t);
}

Measured RatioOfOwnTaps(const Spread& of_a, const Spread& of_b) {
  const double t = StudentT95(std::min(of_a.freedom, of_b.freedom));
  return LogNormal(of_a.Deviation() / of_b.Deviation(),
                   t * std::hypot(LogUncertainty(of_a), LogUncertainty(of_b)), t);
}

/// Returns the reason why the scatter is unknown; empty if it is known.
std::string WhyNot(const SeriesScatter& scatter, std::size_t places, const Spread& spread) {
  if (spread.freedom < kMinComparisonFreedom) {
    return fmt::format(
        "{} of {} taps are good at a place that has two of them, at {} place{}: that leaves {:.0f} "
        "degrees of freedom, and {:.0f} are needed; tap nine times and more at one place, or run a "
        "mesh of eight points and more twice",
        scatter.used, scatter.taps, places, places == 1 ? "" : "s", spread.freedom,
        kMinComparisonFreedom);
  }
  if (!(spread.Deviation() > kMinDeviation_mm)) {
    return "heights at one place do not differ at all: give each tap once";
  }
  return {};
}

std::vector<TapResult> Usable(const TapSeries& one, std::span<const TapSeries> series,
                              bool same_taps) {
  std::vector<TapResult> usable = one.taps;
  for (std::size_t i = 0; same_taps && i < usable.size(); ++i) {
    const bool all = std::all_of(series.begin(), series.end(),
                                 [i](const TapSeries& other) { return other.taps[i].z_mm.good(); });
    if (!all) usable[i].z_mm = {};
  }
  return usable;
}

SeriesScatter ScatterOf(const TapSeries& series, const Heights& heights, const Spread& spread) {
  const Ensemble ensemble = Summarise(series.taps);
  SeriesScatter scatter{.name = series.name,
                        .taps = ensemble.taps,
                        .good = ensemble.good,
                        .used = heights.rest.size(),
                        .claimed_mm = ensemble.predicted_deviation_mm,
                        .mean_step_mm = ensemble.mean_step_mm};
  std::string why = WhyNot(scatter, heights.places.size(), spread);
  scatter.deviation_mm = why.empty() ? DeviationOf(spread) : Measured::CannotTell(std::move(why));
  return scatter;
}

/// Returns the last or first series without a known scatter; null if both are known.
const SeriesScatter* FirstBad(const std::vector<SeriesScatter>& scatters) {
  for (const SeriesScatter* scatter : {&scatters.back(), &scatters.front()}) {
    if (!scatter->deviation_mm.good()) return scatter;
  }
  return nullptr;
}

}  // namespace

std::vector<SeriesScatter> Compare(std::span<const TapSeries> series, bool same_taps) {
  std::vector<SeriesScatter> scatters;
  Heights first;
  Spread spread_of_first;
  for (const TapSeries& one : series) {
    const Heights heights = HeightsOf(one, Usable(one, series, same_taps));
    const Spread spread = AboutMeans(heights);
    SeriesScatter& scatter = scatters.emplace_back(ScatterOf(one, heights, spread));
    if (scatters.size() == 1) {
      first = heights;
      spread_of_first = spread;
      continue;
    }
    if (const SeriesScatter* bad = FirstBad(scatters)) {
      scatter.ratio = bad->deviation_mm;
    } else if (same_taps) {
      scatter.ratio = RatioOfSameTaps(heights, first, spread, spread_of_first);
    } else {
      scatter.ratio = RatioOfOwnTaps(spread, spread_of_first);
    }
  }
  return scatters;
}

}  // namespace trammel::tap
