#include "tap/judge/quality.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr double kAngleScale_s_g = 0.1 / 25;  // 25 gf = 0.1 s: as published
constexpr double kMaxApproach = 0.5;
constexpr double kMaxDeparture = 0.25;
constexpr double kMaxBaseline = 0.25;
constexpr double kMaxDwell = 0.75;
// Share of the pull-back for means that show a pull: short against the separation of ooze (tens of
// um), long against a sample.
constexpr double kPullMean = 0.04;
constexpr std::size_t kMinOfMean = 3;
// Least rise, in parts of the press, between the first and last sample of the compression's line;
// also in deviations of noise. Two samples of a press of five show a fifth.
constexpr double kResolvedRise = 0.15;
constexpr double kResolvedNoise = 4;
// Maximum scatter about that line, as a share of its rise: 0.07 for a parabola, 0.4 and more for a
// step at its end.
constexpr double kResolvedScatter = 0.25;
// Number of samples before the halt that may be pressed already, if no line shows it.
constexpr std::size_t kMaybePressed = 4;

void MeasureBaselines(const TapLines& lines, TapShape& shape) {
  const double difference_g = lines.let_go.force_g - lines.touch.force_g;
  // Drift explains the common part of both baselines, no more than the slower of them.
  const double slow = std::abs(lines.approach.slope_g_s) < std::abs(lines.departure.slope_g_s)
                          ? lines.approach.slope_g_s
                          : lines.departure.slope_g_s;
  const bool same_way = lines.approach.slope_g_s * lines.departure.slope_g_s > 0;
  const double drifted_g = same_way ? slow * (lines.let_go.time_s - lines.touch.time_s) : 0;
  const bool explains = drifted_g * difference_g > 0;
  const double rest_g = std::abs(difference_g) - (explains ? std::abs(drifted_g) : 0);
  shape.unexplained_baseline_g = std::max(0.0, rest_g);
  shape.baseline_ratio = std::abs(difference_g) / shape.compression_g;
}

// Measures the pull against a line through the last half of the free stretch after the break: a
// line, so that drift is not taken for a pull. The means of that half determine the scatter of a
// mean, as noise is seldom white.
void MeasurePull(const CleanTap& clean, const TapLines& lines, double width_s, TapShape& shape) {
  const Samples& samples = clean.samples;
  const std::size_t n = samples.size();
  // Starts at the middle of the press: ooze may put the elbow behind its own pull.
  const std::size_t first = (lines.decompression_first + lines.break_at) / 2;
  if (!(clean.period_s > 0) || n < lines.break_at) {
    return;
  }
  const auto length =
      std::max(kMinOfMean, static_cast<std::size_t>(kPullMean * width_s / clean.period_s));
  if (n < lines.break_at + 6 * length) {
    return;
  }
  const std::size_t free_first = n - (n - lines.break_at) / 2;
  const LineFit free = FitLine(samples, free_first, n);
  const auto missing_g = [&](std::size_t i) {
    return lines.press_sign * (free.Force(samples.time_s[i]) - samples.force_g[i]);
  };
  const auto mean_of = static_cast<double>(length);
  double sum = 0;
  std::size_t i = first;
  for (; i < first + length; ++i) {
    sum += missing_g(i);
  }
  double most = std::max(0.0, sum);
  for (; i + 1 < free_first + length; ++i) {
    sum += missing_g(i) - missing_g(i - length);
    most = std::max(most, sum);
  }
  double squares = 0;
  for (; i < n; ++i) {
    sum += missing_g(i) - missing_g(i - length);
    squares += sum * sum;
  }
  shape.pull_g = most / mean_of;
  const auto means = static_cast<double>(n - free_first - length + 1);
  const double reach_s = lines.let_go.time_s - free.mean_time_s;
  const double of_line_g =
      free.Noise() * std::sqrt(1 / static_cast<double>(free.count) +
                               reach_s * reach_s / std::max(free.time_spread_s2, 1e-12));
  const double of_mean_g =
      std::max(std::sqrt(squares / means) / mean_of, free.Noise() / std::sqrt(mean_of));
  shape.pull_noise_g = std::hypot(of_line_g, of_mean_g);
}

// True if the press has enough samples. On a fast approach or with a slow converter it happens
// between two samples: a line fitted there is flat.
bool IsCollisionResolved(const CleanTap& clean, const TapLines& lines) {
  if (!lines.has_collision || lines.compression.count < 2) {
    return false;
  }
  const auto& times = clean.samples.time_s;
  const double risen_g = lines.press_sign * (lines.compression.Force(times[lines.dwell_first - 1]) -
                                             lines.compression.Force(times[lines.collision]));
  return risen_g > kResolvedRise * std::abs(clean.dwell_g - clean.departure_g) &&
         risen_g > kResolvedNoise * clean.noise_g &&
         lines.compression.Noise() < kResolvedScatter * risen_g &&
         lines.touch.time_s > times[lines.approach_first] &&
         lines.touch.time_s < lines.press_end.time_s;
}

// Uses the halt as collision for the score, with all samples before and after it.
void TakeHaltForCollision(const CleanTap& clean, const TapMotion& motion, TapLines& lines) {
  const double halt_s = motion.approach_end_s - clean.origin_s;
  const std::size_t halt = IndexAt(clean.samples.time_s, halt_s);
  const std::size_t before = std::max(lines.approach_first + kMaybePressed, halt) - kMaybePressed;
  lines.approach = FitLine(clean.samples, lines.approach_first, before);
  lines.dwell = FitLine(clean.samples, std::min(halt + 1, lines.pull_back), lines.pull_back);
  lines.touch = {halt_s, lines.approach.Force(halt_s), 0};
  lines.press_end = {halt_s, lines.dwell.Force(halt_s), 0};
  lines.dwell_end = Intersect(lines.dwell, lines.upper);
}

// Measures the loss of force at rest. A line through a decaying force misses its peak. Means of
// three samples, so that one stray sample makes no peak.
double LostAtRest(const CleanTap& clean, const TapLines& lines) {
  const auto& force_g = clean.samples.force_g;
  if (lines.pull_back < lines.collision + kMinOfMean + 1) {
    return kNoValue;
  }
  const auto sign = static_cast<float>(lines.press_sign);
  const auto sum_of_three = [&](std::size_t i) {
    return sign * (force_g[i - 1] + force_g[i] + force_g[i + 1]);
  };
  const auto above_g = [&](float sum) { return sum / 3.0 - lines.press_sign * clean.approach_g; };
  const std::size_t last = lines.pull_back - 2;
  float peak = sum_of_three(last);
  for (std::size_t i = std::max<std::size_t>(lines.collision, 1); i < last; ++i) {
    peak = std::max(peak, sum_of_three(i));
  }
  return 1 - above_g(sum_of_three(last)) / std::max(0.0, above_g(peak));
}

double Ratio(double value, double most) {
  const double size = std::abs(value);
  return size <= most ? size : 1;  // NaN counts as beyond
}

}  // namespace

TapShape MeasureShape(const CleanTap& clean, const TapMotion& motion, const TapLines& found) {
  TapLines lines = found;
  const bool resolved = IsCollisionResolved(clean, lines);
  if (lines.has_collision && !resolved) {
    TakeHaltForCollision(clean, motion, lines);
  }
  TapShape shape;
  shape.approach_ratio = shape.departure_ratio = shape.baseline_ratio = shape.dwell_ratio =
      kNoValue;
  shape.lost_ratio = shape.compression_g = shape.decompression_g = shape.decompression_rad =
      kNoValue;
  shape.unexplained_baseline_g = shape.press_depth_mm = shape.touch_depth_mm = kNoValue;
  if (!lines.has_break) {
    return shape;
  }
  const double width_s = motion.pull_back_end_s - motion.pull_back_start_s;
  shape.decompression_rad = std::atan(std::abs(lines.whole.slope_g_s) * kAngleScale_s_g);
  shape.press_depth_mm = motion.Z(clean.origin_s + lines.let_go.time_s) - motion.halt_z_mm;
  MeasurePull(clean, lines, width_s, shape);
  if (!lines.has_collision) {
    return shape;
  }
  const double start_s = clean.samples.time_s[lines.approach_first];
  shape.compression_g = std::abs(lines.press_end.force_g - lines.touch.force_g);
  shape.decompression_g = std::abs(lines.dwell_end.force_g - lines.let_go.force_g);
  shape.approach_ratio =
      std::abs(lines.touch.force_g - lines.approach.Force(start_s)) / shape.compression_g;
  shape.departure_ratio =
      std::abs(lines.departure.Force(width_s) - lines.let_go.force_g) / shape.compression_g;
  shape.dwell_ratio =
      std::abs(lines.press_end.force_g - lines.dwell_end.force_g) / shape.compression_g;
  MeasureBaselines(lines, shape);
  shape.lost_ratio = LostAtRest(clean, lines);
  if (resolved) {
    shape.touch_depth_mm = motion.Z(clean.origin_s + lines.touch.time_s) - motion.halt_z_mm;
  }
  return shape;
}

double Score(const TapShape& shape, double calibrated_angle_rad) {
  if (std::isnan(shape.compression_g)) {
    return kNoValue;
  }
  const double angle = std::isnan(calibrated_angle_rad)
                           ? 0
                           : std::abs(shape.decompression_rad / calibrated_angle_rad - 1);
  return 100 * (1 - Ratio(shape.approach_ratio, kMaxApproach)) *
         (1 - Ratio(shape.departure_ratio, kMaxDeparture)) *
         (1 - Ratio(shape.baseline_ratio, kMaxBaseline)) *
         (1 - Ratio(shape.dwell_ratio, kMaxDwell)) * std::max(0.0, 1 - angle);
}

}  // namespace trammel::tap
