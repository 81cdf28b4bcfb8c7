#include "pressure_advance/response/answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

RangedAnswer Outside(const std::string& why, double about_s, const Interval& tested_s) {
  const Interval next = PrintNext(about_s, tested_s);
  return {Measured::CannotTell(
              fmt::format("{}: print a pattern from {:.3g} to {:.3g} s", why, next.lo, next.hi)),
          next};
}

}  // namespace

Interval RangeOf(std::span<const double> pressure_advance_s) {
  TRAMMEL_CHECK(!pressure_advance_s.empty(), "no values");
  const auto [lo, hi] = std::minmax_element(pressure_advance_s.begin(), pressure_advance_s.end());
  return {*lo, *hi};
}

Interval PrintNext(double about_s, const Interval& tested_s) {
  const double beyond = std::max({0.0, tested_s.lo - about_s, about_s - tested_s.hi});
  const double half = (tested_s.hi - tested_s.lo) / 2 + beyond;
  const double lo = std::max(0.0, about_s - half);
  return {lo, std::max(about_s + half, lo + half)};
}

RangedAnswer JudgeInRange(double value_s, double standard_uncertainty_s, double half_width95_s,
                          const Interval& tested_s, double widest, const std::string& too_wide) {
  const Interval interval{value_s - half_width95_s, value_s + half_width95_s};
  const double range = tested_s.hi - tested_s.lo;
  const bool wide = !(half_width95_s <= widest * range);
  const bool inside = value_s >= tested_s.lo && value_s <= tested_s.hi;
  if (wide && inside) return {Measured::CannotTell(too_wide), std::nullopt};
  const auto past = [&](const char* side, bool surely) {
    return fmt::format(
        "the answer {} {} the tested range {:.4g} to {:.4g} s (about {:.3g} s, 95 % "
        "interval {:.3g} to {:.3g} s)",
        surely ? "lies" : "may lie", side, tested_s.lo, tested_s.hi, value_s, interval.lo,
        interval.hi);
  };
  if (interval.hi > tested_s.hi) {
    return Outside(past("above", interval.lo > tested_s.hi), value_s, tested_s);
  }
  if (tested_s.lo > 0 && interval.lo < tested_s.lo) {
    return Outside(past("below", interval.hi < tested_s.lo), value_s, tested_s);
  }
  if (interval.hi < 0) {
    return {Measured::CannotTell(fmt::format(
                "the lines ask for a pressure advance below 0 (95 % interval {:.3g} to {:.3g} s), "
                "and no extruder leads: are the values in order, and is the side at which printing "
                "began right?",
                interval.lo, interval.hi)),
            std::nullopt};
  }
  if (wide) return {Measured::CannotTell(too_wide), std::nullopt};
  // An interval cut off at 0 must still reflect its uncertainty: half of it remains >= one u.
  const double value = std::max(0.0, value_s);
  const double lo = std::max(0.0, interval.lo);
  const double hi = std::max(interval.hi, lo + 2 * standard_uncertainty_s);
  return {Measured::Good({value, standard_uncertainty_s, {lo, hi}}), std::nullopt};
}

namespace {

const char* Blame(const UncertaintyBudget& budget) {
  const std::pair<double, const char*> causes[] = {
      {budget.lines,
       "the lines scatter too much; print more lines, or clean the plate and scan again"},
      {budget.slip,
       "flow that may be lost at the fast speed stays open, as the two changes of speed are not "
       "read "
       "equally well; print with a lower fast speed, or scan again with less ambient light"},
      {budget.unread,
       "too much of the filament that pressure advance moves is not read; widen the crop (crop_px) "
       "if beads reach out of it, print longer lines if they are too short for this lag"},
      {budget.form, "the lag outlasts the fast part of the lines; print longer ones"},
      {budget.drift,
       "the lag seems to drift from line to line; let the hot end settle, and print a pattern with "
       "the answer in its middle"},
      {budget.apart,
       "the two changes of speed contradict each other; print with a lower fast speed"},
      {budget.picture, "the photo is too blurred or too small; take a sharp one from nearer"}};
  return std::max_element(std::begin(causes), std::end(causes),
                          [](const auto& a, const auto& b) { return a.first < b.first; })
      ->second;
}

}  // namespace

double HalfWidth95(const UncertaintyBudget& budget, double freedom) {
  const double ratio = budget.lines > 0 ? budget.total() / budget.lines : 1e6;
  return StudentT95(freedom * ratio * ratio) * std::sqrt(budget.total());
}

RangedAnswer JudgeByBudget(double value_s, const UncertaintyBudget& budget, double freedom,
                           const Interval& tested_s, double widest) {
  const double half = HalfWidth95(budget, freedom);
  const std::string too_wide = fmt::format(
      "the 95 % interval would reach {:.2g} s to either side on a tested range of "
      "{:.2g} s: {}",
      half, tested_s.hi - tested_s.lo, Blame(budget));
  return JudgeInRange(value_s, std::sqrt(budget.total()), half, tested_s, widest, too_wide);
}

namespace {

constexpr const char* kWhatToLookAt =
    "look whether the first layer is even all over the plate, and let the hot end settle";

// Returns a standard uncertainty whose normal interval covers the stated one, which is wider with
// few degrees of freedom.
double Sigma(const Quantity& quantity) {
  const double half = 0.5 * (quantity.interval95.hi - quantity.interval95.lo);
  return std::max(quantity.standard_uncertainty, half / kNormal95);
}

struct Scatter {
  double mean = 0;            // weighed
  double chi_square = 0;      // chi-square about it
  double log_likelihood = 0;  // for these values, whatever their mean
};

Scatter ScatterOf(const std::vector<Quantity>& values, double between_s) {
  double weights = 0, sum = 0, logs = 0;
  for (const Quantity& value : values) {
    const double variance = Square(Sigma(value)) + Square(between_s);
    weights += 1 / variance, sum += value.value / variance, logs += std::log(variance);
  }
  Scatter scatter;
  scatter.mean = sum / weights;
  for (const Quantity& value : values) {
    const double variance = Square(Sigma(value)) + Square(between_s);
    scatter.chi_square += Square(value.value - scatter.mean) / variance;
  }
  scatter.log_likelihood = -0.5 * (logs + std::log(weights) + scatter.chi_square);
  return scatter;
}

// Possible deviations between patterns, and their weights.
struct Between {
  std::vector<double> sigma_s;
  std::vector<double> share;  // sums up to 1
};

// Prior of the scatter between patterns, as a part of the answer: median of a half-Cauchy
// distribution; assumed.
constexpr double kPriorMedian = 0.015;

Between BetweenOf(const std::vector<Quantity>& values, double prior_median_s) {
  constexpr int kSteps = 100;
  Between between;
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < kSteps; ++i) {
    // Equal shares of the prior.
    const double prior = (i + 0.5) / kSteps;
    between.sigma_s.push_back(prior_median_s * std::tan(0.5 * std::acos(-1.0) * prior));
    between.share.push_back(
        values.size() < 2 ? 0 : ScatterOf(values, between.sigma_s.back()).log_likelihood);
    most = std::max(most, between.share.back());
  }
  double sum = 0;
  for (double& share : between.share) sum += share = std::exp(share - most);
  for (double& share : between.share) share /= sum;
  return between;
}

double MedianOf(const Between& between) {
  double sum = 0;
  for (std::size_t i = 0; i < between.share.size(); ++i) {
    sum += between.share[i];
    if (sum >= 0.5) return between.sigma_s[i];
  }
  return between.sigma_s.back();
}

// Returns the half width of the interval that contains 95 % of all normal distributions together.
double HalfWidth95(const Between& between, double sigma_s, double patterns) {
  const auto outside = [&](double half_s) {
    double sum = 0;
    for (std::size_t i = 0; i < between.share.size(); ++i) {
      const double s = std::hypot(sigma_s, between.sigma_s[i] / std::sqrt(patterns));
      sum += between.share[i] * std::erfc(half_s / s / std::sqrt(2.0));
    }
    return sum;
  };
  double lo = kNormal95 * sigma_s;
  double hi = lo;
  while (outside(hi) > 0.05) hi *= 2;  // ends: the widest of the distributions is finite
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) (outside((lo + hi) / 2) > 0.05 ? lo : hi) = (lo + hi) / 2;
  return hi;
}

// Returns the 95 % point of chi square over its degrees of freedom (Wilson and Hilferty; within 2 %
// from 1 on).
double ChiSquare95(double freedom) {
  constexpr double kOneSided95 = 1.644854;
  const double part = 2 / (9 * freedom);
  return freedom * std::pow(1 - part + kOneSided95 * std::sqrt(part), 3);
}

}  // namespace

std::pair<RangedAnswer, Repeats> CombineRepeats(const Quantity& joint,
                                                std::vector<Measured> pattern_s,
                                                const Interval& tested_s, double widest) {
  std::vector<Quantity> good;
  std::vector<double> values_s;
  for (const Measured& pattern : pattern_s) {
    if (!pattern.good()) continue;
    good.push_back(pattern.quantity());
    values_s.push_back(good.back().value);
  }
  Repeats repeats;
  const auto patterns = static_cast<double>(std::max<std::size_t>(pattern_s.size(), 1));
  const bool all_good = good.size() > 1 && good.size() == pattern_s.size();
  repeats.pattern_s = std::move(pattern_s);
  repeats.scatter_s = StandardDeviation(values_s);
  const Between between = BetweenOf(good, kPriorMedian * std::abs(joint.value));
  repeats.between_s = MedianOf(between);
  if (good.size() > 1) {
    repeats.disagree =
        ScatterOf(good, 0).chi_square > ChiSquare95(static_cast<double>(good.size()) - 1);
  }
  const double sigma_s = Sigma(joint);
  const double half_s = HalfWidth95(between, sigma_s, patterns);
  const double u_s = joint.standard_uncertainty * half_s / (kNormal95 * sigma_s);
  const double value_s = all_good ? ScatterOf(good, repeats.between_s).mean : joint.value;
  RangedAnswer answer = JudgeInRange(
      value_s, u_s, half_s, tested_s, widest,
      fmt::format("the patterns differ too much from one another (standard deviation {:.2g} s): "
                  "{}, and print them again",
                  repeats.scatter_s, kWhatToLookAt));
  return {std::move(answer), std::move(repeats)};
}

std::string NoticeOfRepeats(const Repeats& repeats) {
  if (!repeats.disagree) return {};
  return fmt::format(
      "the patterns differ by more than their intervals explain (standard deviation {:.2g} s), and "
      "the answer's interval was widened for it: {}",
      repeats.scatter_s, kWhatToLookAt);
}

}  // namespace trammel::pressure_advance
