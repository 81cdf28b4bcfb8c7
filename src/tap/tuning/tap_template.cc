#include "tap/tuning/tap_template.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/statistics.h"
#include "tap/analyse/analyse.h"
#include "tap/judge/quality.h"
#include "tap/samples/corruption.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"
#include "tap/two_line/tap_lines.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kSamplesPerKnot = 5;
/// Of the whole's slope, the least and the most with which a press goes on beyond what was
/// measured.
constexpr double kLeastSlope = 0.3;
constexpr double kMostSlope = 3;
/// Depths around the break, of the press, that belong neither to it nor to the free nozzle.
constexpr double kNearBreak = 0.15;
constexpr std::size_t kMostFree = 2048;
constexpr std::size_t kMostIntervals = 4096;

/// What is left of a figure once chance (its standard uncertainty) could not have made it.
double Shrunk(double value, double uncertainty) {
  constexpr double kDeviations = 2;
  const double chance = kDeviations * uncertainty / value;
  return std::isfinite(value) && value != 0 ? value * std::max(0.0, 1 - chance * chance) : 0;
}

double SampleRate(const TapView& tap) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < tap.time_s.size(); ++i) {
    const double step = tap.time_s[i] - tap.time_s[i - 1];
    if (step > 0) steps.push_back(step);
  }
  return steps.empty() ? kNan : 1 / Median(steps);
}

/// Free nozzle before the touch and after the break: where in time they lie.
struct FreeTimes {
  double before_from_s = 0;
  double before_to_s = 0;
  double after_from_s = 0;
};

FreeTimes FindFreeTimes(const TapMotion& motion, const TapAnalysis& analysis, double rate_hz) {
  constexpr double kLeastBeforeHalt_s = 0.05;
  constexpr double kTouchDepth = 2;  // of the press: plastic touches before the bed does
  constexpr double kSamples = 3;     // over which a converter smears a corner
  const double press_mm = analysis.force.break_z_mm - motion.halt_z_mm;
  FreeTimes times;
  if (motion.has_approach) {
    times.before_from_s = motion.approach_start_s;
    times.before_to_s =
        motion.approach_end_s - kSamples / rate_hz -
        std::max(kLeastBeforeHalt_s, kTouchDepth * press_mm / motion.approach_speed_mm_s);
  }
  times.after_from_s = analysis.contact_time_s + kSamples / rate_hz +
                       kNearBreak * press_mm / motion.pull_back_speed_mm_s;
  return times;
}

/// A slope that both stretches share, and the levels of each at its end next to the press.
struct FreeLevels {
  double slope_g_s = 0;
  double step_g = 0;  ///< Of the level, less what the slope explains.
};

struct Moments {
  double n = 0, t = 0, f = 0, tt = 0, tf = 0;
  void Add(double time_s, double force_g) {
    ++n;
    t += time_s;
    f += force_g;
    tt += time_s * time_s;
    tf += time_s * force_g;
  }
  [[nodiscard]] double Spread() const { return n > 0 ? tt - t * t / n : 0; }
  [[nodiscard]] double Product() const { return n > 0 ? tf - t * f / n : 0; }
};

FreeLevels ReadLevels(const TapView& tap, const FreeTimes& times, double noise_g) {
  constexpr double kLeast = 8;
  Moments before;
  Moments after;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    const double time_s = tap.time_s[i] - times.after_from_s;
    if (!std::isfinite(tap.force_g[i])) continue;
    if (tap.time_s[i] >= times.before_from_s && tap.time_s[i] <= times.before_to_s) {
      before.Add(time_s, tap.force_g[i]);
    } else if (time_s >= 0) {
      after.Add(time_s, tap.force_g[i]);
    }
  }
  const double spread = before.Spread() + after.Spread();
  if (!(spread > 0)) return {};
  const double slope = (before.Product() + after.Product()) / spread;
  const double slope_u = noise_g / std::sqrt(spread);
  FreeLevels levels{Shrunk(slope, slope_u), 0};
  if (before.n < kLeast || after.n < kLeast) return levels;
  const double apart_s = after.t / after.n - before.t / before.n;
  const double step = after.f / after.n - before.f / before.n - levels.slope_g_s * apart_s;
  const double level_u = noise_g * std::sqrt(1 / before.n + 1 / after.n);
  levels.step_g = Shrunk(step, std::hypot(level_u, slope_u * apart_s));
  return levels;
}

struct Residual {
  double depth_mm;
  double force_g;
};

/// What the samples of the press show beside the fitted polynomial.
std::vector<Residual> ResidualsOf(const TapView& tap, const TapMotion& motion,
                                  const FittedForce& force, const TapTemplate& found) {
  std::vector<Residual> residuals;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    const double acted_s = tap.time_s[i] - found.latency_s;
    if (acted_s < motion.cruise_start_s || acted_s > motion.cruise_end_s) continue;
    const double z = motion.CruiseZ(acted_s);
    const double depth = force.break_z_mm - z;
    if (!(depth > 0) || !std::isfinite(tap.force_g[i])) continue;
    const double base = force.baseline_g - force.baseline_slope_g_mm * depth;
    residuals.push_back({depth, found.sign * (tap.force_g[i] - base) - found.press.Force(depth)});
  }
  return residuals;
}

/// Medians of the residuals in equal parts of a stretch of depth: a lone wild sample makes no form
/// of the press.
/// @param shrink_g  Noise of a sample, that makes no form either; 0 where there is form for
/// certain.
/// @param scatter   Sums of squares about the medians, and how many they are of.
void AddKnots(const std::vector<Residual>& residuals, double from_mm, double to_mm,
              std::size_t most_parts, double shrink_g, MeasuredPress& press,
              std::array<double, 2>& scatter) {
  const auto within = [&](const Residual& residual) {
    return residual.depth_mm > from_mm && residual.depth_mm <= to_mm;
  };
  const auto count =
      static_cast<std::size_t>(std::count_if(residuals.begin(), residuals.end(), within));
  const std::size_t parts = std::min(most_parts, count / kSamplesPerKnot);
  for (std::size_t part = 0; part < parts; ++part) {
    const double step = (to_mm - from_mm) / static_cast<double>(parts);
    const double start = from_mm + step * static_cast<double>(part);
    std::vector<double> forces;
    for (const Residual& residual : residuals) {
      if (residual.depth_mm > start && residual.depth_mm <= start + step) {
        forces.push_back(residual.force_g);
      }
    }
    if (forces.size() < 2) continue;
    const auto n = static_cast<double>(forces.size());
    press.knots.push_back({start + 0.5 * step, Shrunk(Median(forces), shrink_g / std::sqrt(n))});
    const double deviation = RobustStandardDeviation(forces);
    scatter[0] += deviation * deviation * (n - 1);
    scatter[1] += n - 1;
  }
}

/// @param fitted_mm  Depth to which the polynomial was fitted; below, where the drive did not yet
///                   follow, it says nothing, and samples alone show the force.
void ReadRest(const std::vector<Residual>& residuals, double fitted_mm, double noise_g,
              TapTemplate& found) {
  constexpr std::size_t kMostParts = 8;
  constexpr double kMostPressNoise = 5;
  std::array<double, 2> scatter{};
  std::array<double, 2> unused{};
  MeasuredPress& press = found.press;
  AddKnots(residuals, 0, fitted_mm, kMostParts, noise_g, press, scatter);
  AddKnots(residuals, fitted_mm, press.depth_mm, kMostParts, 0, press, unused);
  if (scatter[1] > 0 && noise_g > 0) {
    found.press_noise =
        std::clamp(std::sqrt(scatter[0] / scatter[1]) / noise_g, 1.0, kMostPressNoise);
  }
}

/// What the published decomposition into lines says of dwell, touch and pull.
void ReadShape(const TapView& tap, const TapMotion& motion, TapTemplate& found) {
  std::vector<std::byte> memory(WorkspaceBytes(tap.time_s.size()));
  Workspace workspace(memory);
  const CleanTap clean = CleanSamples(tap, motion, workspace);
  if (!clean.memory_suffices) return;
  const TapShape shape = MeasureShape(clean, motion, FindTapLines(clean, motion));
  constexpr double kMostLost = 0.9;
  constexpr double kPullSignificance = 5;
  if (std::isfinite(shape.dwell_ratio)) found.lost_share = std::min(shape.dwell_ratio, kMostLost);
  const double sampled_mm = 2 * clean.period_s * motion.approach_speed_mm_s;
  const double extra = shape.touch_depth_mm - shape.press_depth_mm - sampled_mm;
  if (extra > 0) found.touch_extra_mm = std::min(extra, 10 * found.press_depth_mm);
  if (shape.pull_g > kPullSignificance * shape.pull_noise_g) found.pull_g = shape.pull_g;
}

void ReadTiming(const TapView& tap, const TapMotion& motion, TapTemplate& found) {
  constexpr double kMost_s = 5;
  constexpr double kLeastWay = 0.1;  // of what samples at the median distance cover
  const double halt_s = motion.has_approach ? motion.approach_end_s : motion.pull_back_start_s;
  found.before_s = std::clamp(halt_s - tap.time_s.front(), 0.0, kMost_s);
  found.dwell_s = motion.has_approach ? std::clamp(motion.pull_back_start_s - halt_s, 0.0, kMost_s)
                                      : found.before_s;
  if (!motion.has_approach) found.before_s = 0;
  found.after_s = std::clamp(tap.time_s.back() - motion.pull_back_end_s, 0.0, kMost_s);
  for (std::size_t i = 1; i < std::min(tap.time_s.size(), kMostIntervals); ++i) {
    const double step = tap.time_s[i] - tap.time_s[i - 1];
    if (step >= 0) found.intervals_s.push_back(step);
  }
  const double rate_hz = found.setting.sample_rate_hz;
  const double sum_s = std::accumulate(found.intervals_s.begin(), found.intervals_s.end(), 0.0);
  if (!(sum_s * rate_hz > kLeastWay * static_cast<double>(found.intervals_s.size()))) {
    found.intervals_s.clear();  // nearly all of them repeat a time
  }
}

}  // namespace

double MeasuredPress::Force(double at_mm) const {
  if (!(at_mm > 0)) return 0;
  const auto within = [&](double depth) {
    double value = 0;
    double power = depth;
    for (const double coefficient : smooth_g) {
      value += coefficient * power;
      power *= depth;
    }
    // From 0 at the break through the knots; level after the last one.
    Knot left;
    for (const Knot& right : knots) {
      if (depth < right.depth_mm) {
        const double part = (depth - left.depth_mm) / (right.depth_mm - left.depth_mm);
        return value + left.rest_g + part * (right.rest_g - left.rest_g);
      }
      left = right;
    }
    return value + left.rest_g;
  };
  if (at_mm <= depth_mm) return within(at_mm);
  // By the slope of its last half, or less where slopes fall: too deep a press is the costly error.
  const double deepest = within(depth_mm);
  const double middle = within(0.5 * depth_mm);
  const double last = (deepest - middle) / (0.5 * depth_mm);
  const double first = middle / (0.5 * depth_mm);
  const double whole = deepest / depth_mm;
  const double slope = std::clamp(std::min(last, 2 * last - first), kLeastSlope * whole,
                                  std::max(whole, kMostSlope * whole));
  return deepest + slope * (at_mm - depth_mm);
}

double MeasuredPress::Depth(double force_g, double most) const {
  constexpr int kSteps = 128;
  double from = 0;
  double from_g = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double to = most * depth_mm * i / kSteps;
    const double to_g = Force(to);
    if (to_g >= force_g) return from + (to - from) * (force_g - from_g) / (to_g - from_g);
    from = to;
    from_g = std::max(from_g, to_g);
  }
  return most * depth_mm;
}

double TapTemplate::DepthWith(double more_g) const {
  constexpr double kMost = 4;
  constexpr double kLeast = 0.05;
  const double force = std::max(kLeast * press_force_g, press_force_g + more_g);
  const double deeper = press.Depth(force, kMost) - press.Depth(press_force_g, kMost);
  return std::max(kLeast * press_depth_mm, press_depth_mm + deeper);
}

std::optional<TapSetting> ReadSetting(const TapView& tap) {
  TapMotion motion;
  if (FindMotion(tap.moves, motion).code != FindingCode::kNone) return std::nullopt;
  return TapSetting{motion.has_approach ? motion.approach_speed_mm_s : kNan,
                    motion.pull_back_speed_mm_s, motion.end_z_mm - motion.halt_z_mm,
                    motion.acceleration_mm_s2, SampleRate(tap)};
}

std::vector<FreeStretch> FreeStretchesOf(const TapView& tap, const TapAnalysis& analysis) {
  TapMotion motion;
  if (FindMotion(tap.moves, motion).code != FindingCode::kNone) return {};
  const FreeTimes times = FindFreeTimes(motion, analysis, SampleRate(tap));
  FreeStretch before{{}, true};
  FreeStretch after;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    const double time_s = tap.time_s[i];
    if (!std::isfinite(tap.force_g[i])) continue;
    if (time_s >= times.before_from_s && time_s <= times.before_to_s) {
      before.force_g.push_back(tap.force_g[i]);
    } else if (time_s >= times.after_from_s && after.force_g.size() < kMostFree) {
      after.force_g.push_back(tap.force_g[i]);
    }
  }
  if (before.force_g.size() > kMostFree) {  // the last ones are nearest to the press
    before.force_g.erase(before.force_g.begin(),
                         before.force_g.end() - static_cast<std::ptrdiff_t>(kMostFree));
  }
  return {std::move(before), std::move(after)};
}

std::optional<TapTemplate> ReadTemplate(const TapView& tap, const TapAnalysis& analysis,
                                        double noise_g) {
  TapMotion motion;
  if (analysis.verdict != Verdict::kGood || !analysis.force.fitted ||
      FindMotion(tap.moves, motion).code != FindingCode::kNone) {
    return std::nullopt;
  }
  const FittedForce& force = analysis.force;
  TapTemplate found;
  found.setting = *ReadSetting(tap);
  found.latency_s = std::isfinite(analysis.latency_s) ? analysis.latency_s : 0;
  found.press_depth_mm = force.break_z_mm - motion.halt_z_mm;
  found.press.depth_mm = force.break_z_mm - motion.cruise_start_z_mm;
  found.press.smooth_g = force.press_g;
  double deepest = 0;
  double power = found.press.depth_mm;
  for (const double coefficient : force.press_g) {
    deepest += coefficient * power;
    power *= found.press.depth_mm;
  }
  found.sign = deepest < 0 ? -1 : 1;
  for (double& coefficient : found.press.smooth_g) coefficient *= found.sign;
  found.tare_g = force.baseline_g;
  if (!(found.press.depth_mm > 0) || !(std::abs(deepest) > 0)) return std::nullopt;
  const double fitted_mm = std::min(force.break_z_mm - force.from_z_mm, found.press.depth_mm);
  ReadRest(ResidualsOf(tap, motion, force, found), fitted_mm, noise_g, found);
  found.press_force_g = found.press.Force(found.press.depth_mm);
  if (!(found.press_force_g > 0)) return std::nullopt;
  const FreeLevels levels =
      ReadLevels(tap, FindFreeTimes(motion, analysis, found.setting.sample_rate_hz), noise_g);
  found.drift_g_s = levels.slope_g_s;
  found.step_g = levels.step_g;
  ReadShape(tap, motion, found);
  ReadTiming(tap, motion, found);
  return found;
}

}  // namespace trammel::tap
