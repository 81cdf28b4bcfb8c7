#include "tap/ensemble/ensemble.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "tap/ensemble/place_groups.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLeastForOutliers = 5;

/// Indices of the taps at each place.
using Group = std::vector<std::size_t>;

/// Median of the slopes between all pairs at one place; 0 without any.
double TheilSenSlope(std::span<const TapResult> taps, const std::vector<Group>& groups) {
  constexpr std::size_t kMost = 200;
  std::vector<double> slopes;
  for (const Group& group : groups) {
    const std::size_t step = 1 + group.size() / kMost;
    for (std::size_t i = 0; i < group.size(); i += step) {
      for (std::size_t j = i + step; j < group.size(); j += step) {
        const TapResult& a = taps[group[i]];
        const TapResult& b = taps[group[j]];
        const double slope = (b.z_mm - a.z_mm) / (b.time_s - a.time_s);
        if (std::isfinite(slope)) slopes.push_back(slope);
      }
    }
  }
  return slopes.empty() ? 0 : Median(slopes);
}

/// Heights less the shared drift, and less the median of the place.
std::vector<double> Detrended(std::span<const TapResult> taps, const Group& group, double slope) {
  std::vector<double> rest;
  for (const std::size_t i : group) {
    const double since = taps[i].time_s - taps[group.front()].time_s;
    rest.push_back(taps[i].z_mm - (std::isfinite(since) ? slope * since : 0));
  }
  const double middle = Median(rest);
  for (double& value : rest) value -= middle;
  return rest;
}

double Rms(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? kNan : std::sqrt(sum / static_cast<double>(values.size()));
}

/// Takes outliers out of the groups. The scale is that of all places together, and never below what
/// the taps themselves claim: a lucky row of equal heights makes no outliers of the others.
std::vector<std::size_t> TakeOutliers(std::span<const TapResult> taps, std::vector<Group>& groups,
                                      double claimed_mm, const EnsembleOptions& options) {
  const double slope = TheilSenSlope(taps, groups);
  std::vector<double> all;
  for (const Group& group : groups) {
    if (group.size() < kLeastForOutliers) continue;
    for (const double value : Detrended(taps, group, slope)) all.push_back(value);
  }
  std::vector<std::size_t> outliers;
  if (all.empty()) return outliers;
  const double scale_mm = std::max(RobustStandardDeviation(all), claimed_mm);
  for (Group& group : groups) {
    if (group.size() < kLeastForOutliers) continue;
    const std::vector<double> rest = Detrended(taps, group, slope);
    Group kept;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const bool apart = std::abs(rest[i]) > options.outlier_deviations * scale_mm;
      (apart ? outliers : kept).push_back(group[i]);
    }
    group = std::move(kept);
  }
  std::sort(outliers.begin(), outliers.end());
  return outliers;
}

/// Least squares with one offset per place.
template <class Abscissa>
std::optional<Trend> FitTrend(std::span<const TapResult> taps, const std::vector<Group>& groups,
                              Abscissa&& abscissa) {
  double xx = 0;
  double xz = 0;
  double zz = 0;
  double freedom = -1;
  for (const Group& group : groups) {
    std::vector<double> x;
    std::vector<double> z;
    for (const std::size_t i : group) {
      if (!std::isfinite(abscissa(taps[i]))) continue;
      x.push_back(abscissa(taps[i]));
      z.push_back(taps[i].z_mm);
    }
    if (x.size() < 2) continue;
    const double mean_x = Mean(x);
    const double mean_z = Mean(z);
    for (std::size_t i = 0; i < x.size(); ++i) {
      xx += (x[i] - mean_x) * (x[i] - mean_x);
      xz += (x[i] - mean_x) * (z[i] - mean_z);
      zz += (z[i] - mean_z) * (z[i] - mean_z);
    }
    freedom += static_cast<double>(x.size()) - 1;
  }
  if (!(freedom >= 1) || !(xx > 0)) return std::nullopt;
  Trend trend;
  trend.slope = xz / xx;
  trend.standard_uncertainty = std::sqrt(std::max(0.0, zz - trend.slope * xz) / freedom / xx);
  const double half = StudentT95(freedom) * trend.standard_uncertainty;
  trend.interval95 = {trend.slope - half, trend.slope + half};
  trend.significant = std::abs(trend.slope) > half;
  return trend;
}

Place PlaceOf(std::span<const TapResult> taps, const Group& group) {
  std::vector<double> z;
  std::vector<double> claimed;
  for (const std::size_t i : group) {
    z.push_back(taps[i].z_mm);
    claimed.push_back(taps[i].standard_uncertainty_mm);
  }
  const double scatter = std::max(StandardDeviation(z), Rms(claimed));
  return {taps[group.front()].x_mm, taps[group.front()].y_mm, group.size(), Mean(z),
          scatter / std::sqrt(static_cast<double>(group.size()))};
}

void AddScatter(std::span<const TapResult> taps, const std::vector<Group>& groups,
                Ensemble& ensemble) {
  double squares = 0;
  double freedom = 0;
  double steps = 0;
  double step_count = 0;
  double range = 0;
  for (const Group& group : groups) {
    if (group.size() < 2) continue;
    double lo = taps[group.front()].z_mm;
    double hi = lo;
    double mean = 0;
    for (const std::size_t i : group) {
      lo = std::min(lo, taps[i].z_mm);
      hi = std::max(hi, taps[i].z_mm);
      mean += taps[i].z_mm / static_cast<double>(group.size());
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
      squares += (taps[group[i]].z_mm - mean) * (taps[group[i]].z_mm - mean);
      if (i > 0) steps += std::abs(taps[group[i]].z_mm - taps[group[i - 1]].z_mm);
    }
    range = std::max(range, hi - lo);
    freedom += static_cast<double>(group.size()) - 1;
    step_count += static_cast<double>(group.size()) - 1;
  }
  const bool any = freedom > 0;
  ensemble.range_mm = any ? range : kNan;
  ensemble.standard_deviation_mm = any ? std::sqrt(squares / freedom) : kNan;
  ensemble.mean_step_mm = any ? steps / step_count : kNan;
}

}  // namespace

Ensemble Summarise(std::span<const TapResult> taps, const EnsembleOptions& options) {
  Ensemble ensemble;
  ensemble.taps = taps.size();
  std::vector<double> claimed;
  for (const TapResult& tap : taps) {
    if (tap.good) claimed.push_back(tap.standard_uncertainty_mm);
  }
  ensemble.good = claimed.size();
  ensemble.predicted_deviation_mm = Rms(claimed);
  std::vector<Group> groups = GroupByPlace(taps, options.same_place_mm);
  ensemble.outliers = TakeOutliers(taps, groups, ensemble.predicted_deviation_mm, options);
  ensemble.used = ensemble.good - ensemble.outliers.size();
  std::erase_if(groups, [](const Group& group) { return group.empty(); });
  AddScatter(taps, groups, ensemble);
  ensemble.with_time = FitTrend(taps, groups, [](const TapResult& tap) { return tap.time_s; });
  ensemble.with_temperature =
      FitTrend(taps, groups, [](const TapResult& tap) { return tap.temperature_c; });
  for (const Group& group : groups) ensemble.places.push_back(PlaceOf(taps, group));
  return ensemble;
}

}  // namespace trammel::tap
