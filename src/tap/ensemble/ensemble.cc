#include "tap/ensemble/ensemble.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMinForOutliers = 5;

double Height(const TapResult& tap) { return tap.z_mm.quantity().value; }

/// Indices of the taps at each place.
using Group = std::vector<std::size_t>;

/// Computes the median of the slopes between all pairs at one place; 0 without any.
double TheilSenSlope(std::span<const TapResult> taps, const std::vector<Group>& groups) {
  constexpr std::size_t kMax = 200;
  std::vector<double> slopes;
  for (const Group& group : groups) {
    const std::size_t step = 1 + group.size() / kMax;
    for (std::size_t i = 0; i < group.size(); i += step) {
      for (std::size_t j = i + step; j < group.size(); j += step) {
        const TapResult& a = taps[group[i]];
        const TapResult& b = taps[group[j]];
        const double slope = (Height(b) - Height(a)) / (b.time_s - a.time_s);
        if (std::isfinite(slope)) slopes.push_back(slope);
      }
    }
  }
  return slopes.empty() ? 0 : Median(slopes);
}

/// Returns heights minus the shared drift and the median of the place.
std::vector<double> Detrended(std::span<const TapResult> taps, const Group& group, double slope) {
  std::vector<double> rest;
  for (const std::size_t i : group) {
    const double since = taps[i].time_s - taps[group.front()].time_s;
    rest.push_back(Height(taps[i]) - (std::isfinite(since) ? slope * since : 0));
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

/// Removes outliers from the groups. The scale is that of all places together, and never below the
/// taps' own uncertainty: a lucky row of equal heights makes no outliers of the others.
std::vector<std::size_t> TakeOutliers(std::span<const TapResult> taps, std::vector<Group>& groups,
                                      double claimed_mm) {
  // Iglewicz & Hoaglin 1993, on the scale of the median absolute deviation.
  constexpr double kOutlierDeviations = 3.5;
  const double slope = TheilSenSlope(taps, groups);
  std::vector<double> all;
  for (const Group& group : groups) {
    if (group.size() < kMinForOutliers) continue;
    for (const double value : Detrended(taps, group, slope)) all.push_back(value);
  }
  std::vector<std::size_t> outliers;
  if (all.empty()) return outliers;
  const double scale_mm = std::max(RobustStandardDeviation(all), claimed_mm);
  for (Group& group : groups) {
    if (group.size() < kMinForOutliers) continue;
    const std::vector<double> rest = Detrended(taps, group, slope);
    Group kept;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const bool apart = std::abs(rest[i]) > kOutlierDeviations * scale_mm;
      (apart ? outliers : kept).push_back(group[i]);
    }
    group = std::move(kept);
  }
  std::sort(outliers.begin(), outliers.end());
  return outliers;
}

/// Fits a trend by least squares with one offset per place.
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
      z.push_back(Height(taps[i]));
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
  const double slope = xz / xx;
  const double uncertainty = std::sqrt(std::max(0.0, zz - slope * xz) / freedom / xx);
  const double half = StudentT95(freedom) * uncertainty;
  return Trend{{slope, uncertainty, {slope - half, slope + half}}, std::abs(slope) > half};
}

Place PlaceOf(std::span<const TapResult> taps, const Group& group) {
  std::vector<double> z;
  std::vector<double> claimed;
  for (const std::size_t i : group) {
    z.push_back(Height(taps[i]));
    claimed.push_back(taps[i].z_mm.quantity().standard_uncertainty);
  }
  const double mean = Mean(z);
  const auto count = static_cast<double>(group.size());
  const double uncertainty = std::max(StandardDeviation(z), Rms(claimed)) / std::sqrt(count);
  const double half = group.size() > 1 ? StudentT95(count - 1) * uncertainty : kNan;
  return {taps[group.front()].x_mm,
          taps[group.front()].y_mm,
          group.size(),
          {mean, uncertainty, {mean - half, mean + half}}};
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
    double lo = Height(taps[group.front()]);
    double hi = lo;
    double mean = 0;
    for (const std::size_t i : group) {
      lo = std::min(lo, Height(taps[i]));
      hi = std::max(hi, Height(taps[i]));
      mean += Height(taps[i]) / static_cast<double>(group.size());
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
      const double z_mm = Height(taps[group[i]]);
      squares += (z_mm - mean) * (z_mm - mean);
      if (i > 0) steps += std::abs(z_mm - Height(taps[group[i - 1]]));
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

/// Square of taps without a place.
constexpr double kNowhere = -1e300;

bool SamePlace(const TapResult& a, const TapResult& b) {
  const bool a_known = std::isfinite(a.x_mm) && std::isfinite(a.y_mm);
  const bool b_known = std::isfinite(b.x_mm) && std::isfinite(b.y_mm);
  if (!a_known || !b_known) return a_known == b_known;
  return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) <= kSamePlace_mm;
}

}  // namespace

/// Groups taps by squares of kSamePlace_mm, so that only neighbours are compared.
std::vector<Group> GroupByPlace(std::span<const TapResult> taps) {
  std::vector<Group> groups;
  std::map<std::pair<double, double>, std::vector<std::size_t>> in_square;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (!taps[i].z_mm.good()) continue;
    const bool known = std::isfinite(taps[i].x_mm) && std::isfinite(taps[i].y_mm);
    const double column = known ? std::floor(taps[i].x_mm / kSamePlace_mm) : kNowhere;
    const double row = known ? std::floor(taps[i].y_mm / kSamePlace_mm) : kNowhere;
    std::optional<std::size_t> found;
    for (int side = 0; side < 9 && !found; ++side) {
      const auto square = in_square.find({column + side % 3 - 1, row + side / 3 - 1});
      if (square == in_square.end()) continue;
      for (const std::size_t group : square->second) {
        if (SamePlace(taps[groups[group].front()], taps[i])) found = group;
      }
    }
    if (found) {
      groups[*found].push_back(i);
    } else {
      in_square[{column, row}].push_back(groups.size());
      groups.push_back({i});
    }
  }
  return groups;
}

Ensemble Summarise(std::span<const TapResult> taps) {
  Ensemble ensemble;
  ensemble.taps = taps.size();
  std::vector<double> claimed;
  for (const TapResult& tap : taps) {
    if (tap.z_mm.good()) claimed.push_back(tap.z_mm.quantity().standard_uncertainty);
  }
  ensemble.good = claimed.size();
  ensemble.predicted_deviation_mm = Rms(claimed);
  std::vector<Group> groups = GroupByPlace(taps);
  ensemble.outliers = TakeOutliers(taps, groups, ensemble.predicted_deviation_mm);
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
