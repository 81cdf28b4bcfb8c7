#include "tap/ensemble/method_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/statistics.h"
#include "tap/ensemble/place_groups.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// A deviation below a nanometre is no machine's: the same tap was given several times.
constexpr double kLeastDeviation_mm = 1e-6;

/// Heights by both methods, of the taps at one place, in the order of time.
struct Heights {
  double two_line_mm = 0;
  double contact_mm = 0;
};
using Series = std::vector<Heights>;

Heights operator-(const Heights& a, const Heights& b) {
  return {a.two_line_mm - b.two_line_mm, a.contact_mm - b.contact_mm};
}

/// Sums of squares and products, of which `freedom` are independent.
struct Sums {
  double two_line = 0;
  double contact = 0;
  double both = 0;
  double freedom = 0;

  void Add(const Heights& deviation, double weight) {
    two_line += weight * deviation.two_line_mm * deviation.two_line_mm;
    contact += weight * deviation.contact_mm * deviation.contact_mm;
    both += weight * deviation.two_line_mm * deviation.contact_mm;
  }
  void Add(const Sums& other) {
    two_line += other.two_line;
    contact += other.contact;
    both += other.both;
    freedom += other.freedom;
  }
};

Heights MeanOf(const Series& series) {
  Heights mean;
  const auto count = static_cast<double>(series.size());
  for (const Heights& heights : series) {
    mean.two_line_mm += heights.two_line_mm / count;
    mean.contact_mm += heights.contact_mm / count;
  }
  return mean;
}

/// The sums of all taps, and what each tap takes with it when it is left out.
struct Spread {
  Sums all;
  std::vector<Sums> without;  ///< Taken off `all`.
  double effective_freedom = 0;
  double student95 = 0;  ///< For that freedom, which takes long to find.
};

void AddAboutMean(const Series& series, Spread& spread) {
  const auto count = static_cast<double>(series.size());
  const Heights mean = MeanOf(series);
  Sums sums{.freedom = count - 1};
  for (const Heights& heights : series) {
    sums.Add(heights - mean, 1);
    Sums without{.freedom = 1};
    without.Add(heights - mean, count / (count - 1));
    spread.without.push_back(without);
  }
  spread.all.Add(sums);
  spread.effective_freedom += count - 1;
}

/// @param variance  Of the sum of all places in units of sigma^4; 3 n - 4 are added.
void AddSteps(const Series& series, Spread& spread, double& variance) {
  constexpr double kOfOneHeight = 0.5;  // a step has the variance of two
  const std::size_t count = series.size();
  Sums sums{.freedom = static_cast<double>(count - 1)};
  for (std::size_t i = 0; i < count; ++i) {
    Sums without{.freedom = 1};
    if (i > 0) {
      sums.Add(series[i] - series[i - 1], kOfOneHeight);
      without.Add(series[i] - series[i - 1], kOfOneHeight);
    }
    if (i + 1 < count) without.Add(series[i + 1] - series[i], kOfOneHeight);
    if (i > 0 && i + 1 < count) without.Add(series[i + 1] - series[i - 1], -kOfOneHeight);
    spread.without.push_back(without);
  }
  spread.all.Add(sums);
  variance += 3 * static_cast<double>(count) - 4;
}

Spread SpreadAboutMeans(const std::vector<Series>& places) {
  Spread spread;
  for (const Series& series : places) AddAboutMean(series, spread);
  if (spread.effective_freedom > 0) spread.student95 = StudentT95(spread.effective_freedom);
  return spread;
}

Spread SpreadOfSteps(const std::vector<Series>& places) {
  Spread spread;
  double variance = 0;
  for (const Series& series : places) AddSteps(series, spread, variance);
  const double steps = spread.all.freedom;
  spread.effective_freedom = variance > 0 ? 2 * steps * steps / variance : 0;
  if (spread.effective_freedom > 0) spread.student95 = StudentT95(spread.effective_freedom);
  return spread;
}

/// Standard uncertainty of the logarithm's half, by leaving one tap out at a time.
template <class Square>
double Jackknife(const Spread& spread, Square&& square) {
  std::vector<double> logs;
  for (const Sums& without : spread.without) {
    const double one = std::log(square(spread.all, without)) / 2;
    if (std::isfinite(one)) logs.push_back(one);
  }
  if (logs.size() < 2) return 0;
  const auto count = static_cast<double>(logs.size());
  return StandardDeviation(logs) * (count - 1) / std::sqrt(count);
}

/// A positive quantity whose logarithm has a symmetric interval.
Measured LogNormal(double value, double half_width, double student95) {
  return Measured::Good({value,
                         value * half_width / student95,
                         {value * std::exp(-half_width), value * std::exp(half_width)}});
}

Measured DeviationOf(const Spread& spread, double Sums::*square) {
  const double freedom = spread.effective_freedom;
  const double by_form = 1 / std::sqrt(2 * freedom);
  const double by_taps = Jackknife(spread, [square](const Sums& all, const Sums& without) {
    return (all.*square - without.*square) / (all.freedom - without.freedom);
  });
  return LogNormal(std::sqrt(spread.all.*square / spread.all.freedom),
                   spread.student95 * std::max(by_form, by_taps), spread.student95);
}

Measured RatioOf(const Spread& spread) {
  const Sums& all = spread.all;
  const double freedom = spread.effective_freedom;
  const double t = StudentT95(freedom - 1);
  const double alone = std::max(0.0, 1 - all.both * all.both / (all.two_line * all.contact));
  const double by_form = std::acosh(1 + 2 * alone * t * t / (freedom - 1)) / 2;
  const double by_taps = Jackknife(spread, [](const Sums& sums, const Sums& without) {
    return (sums.contact - without.contact) / (sums.two_line - without.two_line);
  });
  return LogNormal(std::sqrt(all.contact / all.two_line),
                   std::max(by_form, spread.student95 * by_taps), spread.student95);
}

Measured DifferenceOf(const std::vector<Series>& places) {
  std::vector<double> differences;
  for (const Series& series : places) {
    for (const Heights& heights : series) {
      differences.push_back(heights.contact_mm - heights.two_line_mm);
    }
  }
  const auto count = static_cast<double>(differences.size());
  const double uncertainty = StandardDeviation(differences) / std::sqrt(count);
  const double mean = Mean(differences);
  const double half = StudentT95(count - 1) * uncertainty;
  return Measured::Good({mean, uncertainty, {mean - half, mean + half}});
}

/// Empty where scatter can be told.
std::string WhyNot(const MethodComparison& comparison, const Spread& spread) {
  if (spread.all.freedom < kLeastComparisonFreedom) {
    return fmt::format(
        "{} of {} taps are read by both methods at a place that has two of them, at {} place{}: "
        "that leaves {:.0f} degrees of freedom, and {:.0f} are needed; tap nine times and more at "
        "one place, or run a mesh of eight points and more twice",
        comparison.used, comparison.taps, comparison.places, comparison.places == 1 ? "" : "s",
        spread.all.freedom, kLeastComparisonFreedom);
  }
  const double least = std::min(spread.all.two_line, spread.all.contact) / spread.all.freedom;
  if (!(std::sqrt(least) > kLeastDeviation_mm)) {
    return "heights at one place do not differ at all: the same tap seems to be given several "
           "times; give each tap once";
  }
  return {};
}

void Conclude(MethodComparison& comparison) {
  const Quantity& ratio = comparison.ratio.quantity();
  const std::string figures =
      fmt::format("deviation of contact / two-line {:.2f} (95 %: {:.2f} to {:.2f})", ratio.value,
                  ratio.interval95.lo, ratio.interval95.hi);
  if (ratio.interval95.hi < 1) {
    comparison.better = Repeats::kContactBetter;
    comparison.because = "contact repeats better: " + figures;
  } else if (ratio.interval95.lo > 1) {
    comparison.better = Repeats::kTwoLineBetter;
    comparison.because = "two-line repeats better: " + figures;
  } else {
    comparison.because = figures + " holds 1";
    // The interval's width goes with one over the root of the taps.
    constexpr double kWorthTelling = 0.05;
    constexpr double kMostTaps = 10'000;
    const double gain = std::abs(std::log(ratio.value));
    const double wider = std::log(ratio.interval95.hi / ratio.value) / gain;
    const double taps = std::ceil(static_cast<double>(comparison.used) * wider * wider / 10) * 10;
    if (gain > kWorthTelling && taps < kMostTaps) {
      comparison.because += fmt::format(
          "; if it is so, about {:.0f} taps in place of {} would show it", taps, comparison.used);
    }
  }
}

double Claimed(std::span<const TwiceRead> taps, const std::vector<bool>& used,
               TapResult TwiceRead::*method) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (!used[i]) continue;
    const double claimed = (taps[i].*method).standard_uncertainty_mm;
    sum += claimed * claimed;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : kNan;
}

/// Fills the counts and residuals of the comparison, and returns the heights place by place.
std::vector<Series> HeightsByPlace(std::span<const TwiceRead> taps, const EnsembleOptions& options,
                                   MethodComparison& comparison) {
  std::vector<TapResult> both;
  for (const TwiceRead& tap : taps) {
    both.push_back(tap.contact);
    both.back().good = tap.contact.good && tap.two_line.good;
    comparison.contact.good += tap.contact.good ? 1 : 0;
    comparison.two_line.good += tap.two_line.good ? 1 : 0;
  }
  comparison.taps = taps.size();
  comparison.residuals.assign(taps.begin(), taps.end());
  std::vector<bool> used(taps.size(), false);
  std::vector<Series> places;
  for (const std::vector<std::size_t>& group : GroupByPlace(both, options.same_place_mm)) {
    if (group.size() < 2) continue;
    Series& series = places.emplace_back();
    for (const std::size_t i : group) {
      series.push_back({taps[i].two_line.z_mm, taps[i].contact.z_mm});
      used[i] = true;
      if (!std::isfinite(both[i].x_mm) || !std::isfinite(both[i].y_mm)) ++comparison.unplaced;
    }
    const Heights mean = MeanOf(series);
    for (const std::size_t i : group) {
      comparison.residuals[i].two_line.z_mm -= mean.two_line_mm;
      comparison.residuals[i].contact.z_mm -= mean.contact_mm;
    }
    comparison.used += group.size();
  }
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (used[i]) continue;
    comparison.residuals[i].two_line.z_mm = comparison.residuals[i].contact.z_mm = kNan;
  }
  comparison.places = places.size();
  comparison.two_line.claimed_mm = Claimed(taps, used, &TwiceRead::two_line);
  comparison.contact.claimed_mm = Claimed(taps, used, &TwiceRead::contact);
  return places;
}

}  // namespace

std::string_view ToString(Repeats better) {
  switch (better) {
    case Repeats::kCannotTell:
      return "cannot_tell";
    case Repeats::kContactBetter:
      return "contact";
    case Repeats::kTwoLineBetter:
      return "two_line";
  }
  return "cannot_tell";
}

MethodComparison CompareMethods(std::span<const TwiceRead> taps, const EnsembleOptions& options) {
  MethodComparison comparison;
  const std::vector<Series> places = HeightsByPlace(taps, options, comparison);
  const Spread scatter = SpreadAboutMeans(places);
  comparison.because = WhyNot(comparison, scatter);
  if (!comparison.because.empty()) {
    const Measured none = Measured::CannotTell(comparison.because);
    comparison.two_line.deviation_mm = comparison.two_line.back_to_back_mm = none;
    comparison.contact.deviation_mm = comparison.contact.back_to_back_mm = none;
    comparison.ratio = comparison.back_to_back_ratio = comparison.difference_mm = none;
    return comparison;
  }
  const Spread steps = SpreadOfSteps(places);
  comparison.two_line.deviation_mm = DeviationOf(scatter, &Sums::two_line);
  comparison.contact.deviation_mm = DeviationOf(scatter, &Sums::contact);
  comparison.two_line.back_to_back_mm = DeviationOf(steps, &Sums::two_line);
  comparison.contact.back_to_back_mm = DeviationOf(steps, &Sums::contact);
  comparison.ratio = RatioOf(scatter);
  comparison.back_to_back_ratio = RatioOf(steps);
  comparison.difference_mm = DifferenceOf(places);
  Conclude(comparison);
  return comparison;
}

}  // namespace trammel::tap
