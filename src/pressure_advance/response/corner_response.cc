#include "pressure_advance/response/corner_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/statistics.h"
#include "pressure_advance/response/answer.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {
namespace {

constexpr std::size_t kFewestCorners = 6;

// Surplus that the shape of a corner has at any pressure advance: it is round outside, has a fillet
// inside, casts shadows, and filament gains height instead of width. -0.10 mm on one real print
// with its author's choice, and this on 47 virtual ones (seeds 360000 to 360023 of both tools), of
// which 27 were answered, 2.2 ms rms beside the right value.
constexpr double kShape_mm = -0.12;
constexpr double kShapeSigma_mm = 0.03;
// 1 sigma of the value itself: where a corner's surplus goes depends on speed, acceleration and
// filament. Of the same prints.
constexpr double kModel_s = 0.0025;
// 1 sigma of the surplus that a shadow changes, over the share by which it makes one arm look
// wider: about the length of band around which it turns. Assumed.
constexpr double kShadow_mm = 1;
// Smoothing's shift and its 1 sigma where speed, acceleration or firmware are unknown: between none
// (Marlin) and Klipper's, 3 ms at 100 mm/s and 3000 mm/s2, 5 ms at 200 mm/s and 10000 mm/s2.
constexpr double kUnknownShift_s = 0.002;
constexpr double kUnknownSigma_s = 0.003;
constexpr double kMinSignificance = 5;  // of the slope, as for lines
constexpr double kWidest = 0.2;         // half of the interval, as a part of the tested range

// A corner's gap cannot become emptier than empty: flatter beyond the answer.
const signal::ZeroCrossingOptions kOptions{
    .bend_mean = 0, .bend_sigma = 0.15, .distance_sigma = 0.15, .may_saturate = true};

std::string MotionText(const CornerMotion& motion) {
  if (!motion.speed_mm_s) return "at the printed speed and acceleration";
  std::string text = fmt::format("at {:.4g} mm/s", *motion.speed_mm_s);
  if (motion.acceleration_mm_s2)
    text += fmt::format(" and {:.4g} mm/s2", *motion.acceleration_mm_s2);
  return text;
}

// Corners on both sides of the answer that decide it: farther ones bend the response.
constexpr std::size_t kNear = 9;

// Returns the index that parts surplus from lack with the least contradiction: corners before it
// should have too much filament.
std::size_t PartingOf(std::span<const double> surplus) {
  std::size_t best = 0;
  double least = 0;
  for (const double y : surplus) least += std::pow(std::max(0.0, y), 2);
  double sum = least;
  for (std::size_t i = 0; i < surplus.size(); ++i) {
    const double y = surplus[i];
    sum += std::pow(std::min(0.0, y), 2) - std::pow(std::max(0.0, y), 2);
    if (sum < least) {
      least = sum;
      best = i + 1;
    }
  }
  return best;
}

// Fits the corners near the crossing.
struct NearFit {
  signal::ZeroCrossing fit;
  std::size_t first = 0;  // of the sorted corners
};

std::optional<NearFit> FitNear(const std::vector<double>& x, const std::vector<double>& y,
                               const std::vector<double>& sigma) {
  const std::size_t count = std::min(kNear, x.size());
  std::size_t middle = PartingOf(y);
  std::optional<NearFit> best;
  for (int round = 0; round < 3; ++round) {
    const std::size_t first =
        std::min(middle > count / 2 ? middle - count / 2 : 0, x.size() - count);
    const auto part = [&](const std::vector<double>& all) {
      return std::span(all).subspan(first, count);
    };
    const auto fit = signal::FitZeroCrossing(part(x), part(y), part(sigma), kOptions);
    if (!fit) return std::nullopt;
    best = NearFit{*fit, first};
    const auto after = std::lower_bound(x.begin(), x.end(), fit->zero);
    middle = static_cast<std::size_t>(after - x.begin());
  }
  return best;
}

// Returns by how much smoothing raises the crossing at most, s. It pushes filament early, out of
// the corner and back into it: the more, the shorter the dip 2 v / a is beside the smooth time. By
// integration of a linear lag of 40 ms, 50 to 200 mm/s, 1000 to 10000 mm/s2: 0.8 to 15 ms.
std::optional<double> SmoothingOf(const CornerMotion& motion) {
  if (!motion.speed_mm_s || !motion.acceleration_mm_s2) return std::nullopt;
  const double dip_s = 2 * *motion.speed_mm_s / *motion.acceleration_mm_s2;
  const double smooth_s = motion.smooth_time_s;
  return std::min(smooth_s * smooth_s / (4 * dip_s), 0.35 * smooth_s);
}

RangedAnswer Judge(const signal::ZeroCrossing& fit, double wider, const CornerMotion& motion,
                   const Interval& tested) {
  if (!(fit.slope > kMinSignificance * fit.slope_sigma)) {
    return {Measured::CannotTell(fmt::format(
                "the corners do not become clearly thinner with pressure advance (slope {:.3g} "
                "mm/s, standard error {:.2g}; {:g} standard errors are needed): print lines (PA "
                "Line) instead, or a lower acceleration, if the values are in order",
                fit.slope, fit.slope_sigma, kMinSignificance)),
            std::nullopt};
  }
  const double lines = std::hypot(fit.zero_sigma, fit.bend_shift);
  const auto smoothing = SmoothingOf(motion);
  const double value = fit.zero - (smoothing ? *smoothing / 2 : kUnknownShift_s);
  const double smoothed = smoothing ? *smoothing / 3 : kUnknownSigma_s;
  const double shadow_mm = kShadow_mm * std::abs(wider);
  const double shape = std::hypot(kShapeSigma_mm, shadow_mm) / fit.slope;
  const double sigma =
      std::sqrt(lines * lines + smoothed * smoothed + shape * shape + kModel_s * kModel_s);
  const double freedom = std::max(1.0, fit.points - 3);
  const double ratio = sigma * sigma / std::max(1e-12, lines * lines);
  const double half = StudentT95(freedom * ratio * ratio) * sigma;
  // Near 0 no corner lies on the other side of the crossing. Of 116 answers (virtual photos, seeds
  // 910000 to 910099 of both tools) 7 had an interval that reached 0, and 3 of these missed the
  // right value, of the other 109 one.
  if (value < half && value + half < tested.hi) {
    return {Measured::CannotTell(fmt::format(
                "0 to {:.2g} s are possible: corners do not tell so low a value; print lines (PA "
                "Line) instead",
                std::max(0.0, value) + half)),
            std::nullopt};
  }
  return JudgeInRange(
      value, sigma, half, tested, kWidest,
      fmt::format("about {:.3f} s, but the 95 % interval would reach {:.2g} s to either side on a "
                  "tested range of {:.2g} s: {} print lines (PA Line) instead",
                  std::max(0.0, value), half, tested.hi - tested.lo,
                  shape < lines ? "the corners scatter too much;"
                  : shadow_mm > kShapeSigma_mm
                      ? fmt::format("the arms on one side of the corners look {:.0f} % wider than "
                                    "those on the other, as shadows make them. Photograph it in "
                                    "light from all sides, or",
                                    100 * std::abs(wider))
                      : "at this acceleration a corner tells little;"));
}

}  // namespace

Analysis FitCorners(const std::vector<CornerSurplus>& corners, const CornerMotion& motion) {
  Analysis analysis;
  CornerResult& result = analysis.corners.emplace();
  result.speed_mm_s = motion.speed_mm_s;
  result.acceleration_mm_s2 = motion.acceleration_mm_s2;
  result.half_window_mm = kCornerWindow_mm;
  const std::size_t n = corners.size();
  TransitionResult& response = result.response;
  response.window_begin = -result.half_window_mm;
  response.window_end = result.half_window_mm;
  response.surplus_s.assign(n, 0);
  response.sigma_s.assign(n, 0);
  response.fitted_s.assign(n, 0);
  std::vector<double> x, y, sigma, wider;
  std::vector<std::size_t> index;  // of the usable corners, by pressure advance
  for (std::size_t i = 0; i < n; ++i) {
    LineResult& line = analysis.lines.emplace_back();
    line.pressure_advance_s = corners[i].pressure_advance_s;
    line.reason = corners[i].unusable;
    line.used = corners[i].unusable.empty();
    if (line.used) index.push_back(i);
  }
  std::ranges::stable_sort(index, {}, [&](std::size_t i) { return corners[i].pressure_advance_s; });
  for (const std::size_t i : index) {
    x.push_back(corners[i].pressure_advance_s);
    y.push_back(corners[i].surplus_mm - kShape_mm);
    sigma.push_back(corners[i].sigma_mm);
    wider.push_back(corners[i].wider);
  }
  const auto answer = [&](RangedAnswer ranged) {
    static_cast<RangedAnswer&>(analysis) = ranged;
    response.pressure_advance = std::move(ranged.pressure_advance);
    return analysis;
  };
  const auto near = x.size() < kFewestCorners ? std::nullopt : FitNear(x, y, sigma);
  if (!near) {
    return answer({Measured::Refused(fmt::format("{} of {} corners can be used, at least {} are "
                                                 "needed",
                                                 x.size(), n, kFewestCorners)),
                   std::nullopt});
  }
  const signal::ZeroCrossing& fit = near->fit;
  constexpr double kIgnored = 0.05;  // of a robust weight
  const double per_mm_s = fit.slope > 0 ? 1 / fit.slope : 1;
  for (std::size_t k = 0; k < index.size(); ++k) {
    const std::size_t i = index[k], of_fit = k - near->first;
    response.surplus_s[i] = y[k] * per_mm_s;
    response.fitted_s[i] = signal::ResponseAt(fit, x[k]) * per_mm_s;
    const bool is_near = k >= near->first && of_fit < fit.weight.size();
    if (is_near && fit.weight[of_fit] > kIgnored) {
      response.sigma_s[i] = std::hypot(sigma[k], fit.residual_scale) * per_mm_s;
    } else {
      analysis.lines[i].used = false;
      analysis.lines[i].reason =
          is_near ? "does not follow the other corners" : "too far from the answer to tell more";
    }
  }
  RangedAnswer ranged = Judge(fit, Median(wider), motion, RangeOf(x));
  if (ranged.pressure_advance.good()) {
    analysis.notices.push_back(fmt::format(
        "this is the value for corners {}; long lines may ask for more, where the filament's lag "
        "falls with flow",
        MotionText(motion)));
  }
  return answer(std::move(ranged));
}

}  // namespace trammel::pressure_advance
