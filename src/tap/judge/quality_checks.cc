#include "tap/judge/quality_checks.h"

#include <algorithm>
#include <cmath>

#include "tap/samples/finding.h"
#include "tap/samples/hum.h"

namespace trammel::tap {
namespace {

// Each limit with its origin. Maximum shares of the pull-back's cruise that may be dropped: samples
// that repeat a time up to a fifth, which widens the scatter by a tenth; stray ones up to a tenth,
// as smaller ones beside them are not dropped.
constexpr double kMaxRepeated = 0.2;
constexpr double kMaxStray = 0.1;
// Maximum samples missing in a row at the break: five at a micron each are the scatter of the best
// taps.
constexpr double kMaxMissingAtBreak = 5;
// Maximum way of the pull-back over which a clock may step: the interval contains both of its
// times.
constexpr double kMaxClockStep_mm = 0.001;
// Maximum clipped or repeated samples in the cruise: two are one step of a slow converter.
constexpr double kMaxFrozen = 2;
// Minimum press in deviations: below it no halves differ by two (write-up).
constexpr double kMinPress = 4;
// Minimum peak in deviations of an impulse; lower ones are noise.
constexpr double kImpulse = 10;
// Maximum slope of a free nozzle at the end of the pull-back, as a share of the decompression's.
constexpr double kFreeSlope = 0.3;
// Last part of the cruise for that slope: as many samples as noise requires to determine it to an
// eighth of the decompression's, at least eight, at most a third of the cruise.
constexpr double kEndOfCruise = 0.15;
constexpr double kMinAtEnd = 8;
constexpr double kMaxOfCruise = 1.0 / 3;
constexpr double kSlopesKnown = 8;
constexpr double kEndSignificance = 3;
constexpr double kSignificant = 4;
// Published cut-off of the score, in parts of the compression force.
constexpr double kMaxDwell = 0.75;

// Published limit of an older classifier, in percent. Sound taps, real ones too, have 90 and more.
constexpr double kMinDecompression = 66.6;
constexpr double kNoticedDecompression = 85;
// Limits of the touch's depth. Touch and break are at one height, so the touch is as deep below it
// as the press, plus three samples of the way down: a converter's filter smears it over two or
// three. Real clean taps reach 1.0 beyond those samples, one that Prusa calls problematic 1.5.
// Three times the press is certainly something on the nozzle.
constexpr double kNoticedTouch = 1.5;
constexpr double kMaxTouch = 3;
constexpr double kTouchSamples = 3;
constexpr double kPressedMidway = 0.05;  // of the press: more than baselines differ by
// Limits of a force change around the break. A tenth of the press moves the break by a tenth of the
// press' depth: 4.5 um of 45, more than the 4 um required of a real tap. (The published score drops
// to 0 at a quarter.) Sound real taps show up to 3 %.
constexpr double kMaxBaseline = 0.10;
constexpr double kNoticedBaseline = 0.05;
constexpr double kMaxPull = 0.10;
constexpr double kNoticedPull = 0.05;
constexpr double kPullSignificance = 5;
// Drift over a pull-back: a tenth of the press.
constexpr double kNoticedDrift = 0.10;
// Maximum nozzle temperature: published advice is to probe at 140 degC; heaters overshoot by some.
constexpr double kMaxNozzle_c = 150;
constexpr double kMinPressDepth_mm = 0.020;

double Count(std::size_t count) { return static_cast<double>(count); }

Finding CheckSamples(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
                     TapAnalysis& result) {
  Finding refusal;
  const auto note = [&](FindingCode code, double figure, double limit, bool refuse) {
    if (figure <= 0) {
      return;
    }
    if (refuse && refusal.code == FindingCode::kNone) {
      refusal = {code, figure, limit};
    } else {
      result.Notice({code, figure, limit});
    }
  };
  const double in_cruise =
      clean.period_s > 0 ? (motion.cruise_end_s - motion.cruise_start_s) / clean.period_s : 0;
  const double max_stray = std::max(1.0, std::floor(kMaxStray * in_cruise));
  const double max_repeated = std::max(1.0, std::floor(kMaxRepeated * in_cruise));
  note(FindingCode::kStuckSamples, Count(clean.stuck), kMaxFrozen,
       Count(clean.stuck_in_cruise) > kMaxFrozen);
  note(FindingCode::kSaturatedSamples, Count(clean.saturated), kMaxFrozen,
       Count(clean.saturated_in_cruise) > kMaxFrozen);
  note(clean.spikes_are_equal ? FindingCode::kErrorFrames : FindingCode::kSpikes,
       Count(clean.spikes), max_stray, Count(clean.spikes_in_cruise) > max_stray);
  note(FindingCode::kHeldValues, Count(clean.held), 0, false);
  note(FindingCode::kDuplicateTimes, Count(clean.duplicated), max_repeated,
       Count(clean.duplicated_in_cruise) > max_repeated);
  const double clock_s = std::max(clean.clock_steps.forward_s, clean.clock_steps.backward_s);
  const double max_clock_s = kMaxClockStep_mm / motion.pull_back_speed_mm_s;
  note(FindingCode::kClockStep, 1e3 * clock_s, 1e3 * max_clock_s, clock_s > max_clock_s);
  const double gap_end_s = clean.longest_gap_start_s + clean.longest_gap_s;
  const bool at_break = lines.has_break && clean.longest_gap_start_s < lines.let_go.time_s &&
                        lines.let_go.time_s < gap_end_s &&
                        clean.longest_gap_s > (kMaxMissingAtBreak + 1.5) * clean.period_s;
  note(FindingCode::kDroppedSamples, Count(clean.dropped), kMaxMissingAtBreak, at_break);
  return refusal;
}

// Returns the highest mean of three samples around the halt.
double PeakBeforePullBack(const CleanTap& clean, const TapLines& lines) {
  double peak = 0;
  const auto& force_g = clean.samples.force_g;
  for (std::size_t i = 1; i + 1 < lines.pull_back && i + 1 < force_g.size(); ++i) {
    const double mean = (force_g[i - 1] + force_g[i] + force_g[i + 1]) / 3.0;
    peak = std::max(peak, std::abs(mean - clean.departure_g));
  }
  return peak;
}

Finding CheckPress(const CleanTap& clean, const TapMotion& motion, const TapLines& lines) {
  const double press_g = std::abs(clean.dwell_g - clean.departure_g);
  const double min_g = kMinPress * clean.noise_g;
  // Negated so that NaN, without samples, is a refusal.
  if (!(press_g > min_g)) {
    const double peak_g = PeakBeforePullBack(clean, lines);
    return peak_g > kImpulse * clean.noise_g && peak_g > 2 * press_g
               ? Finding{FindingCode::kMidAirImpulse, peak_g, min_g}
               : Finding{FindingCode::kNoContact, std::isnan(press_g) ? 0 : press_g, min_g};
  }
  const double end_s = motion.cruise_end_s - clean.origin_s;
  const double cruise_s = motion.cruise_end_s - motion.cruise_start_s;
  const double slope_g_s = std::abs(lines.whole.slope_g_s);
  // A slope from n samples scatters by noise sqrt(12) / (period n^1.5).
  const double for_noise =
      slope_g_s > 0
          ? std::pow(kSlopesKnown * std::sqrt(12.0) * clean.noise_g / (clean.period_s * slope_g_s),
                     2.0 / 3)
          : 0;
  const double part_s = std::max({kEndOfCruise * cruise_s, kMinAtEnd * clean.period_s,
                                  std::min(for_noise * clean.period_s, kMaxOfCruise * cruise_s)});
  const double last_s = end_s - part_s;
  const auto times = clean.samples.time_s;
  const LineFit last = FitLine(clean.samples, IndexAt(times, last_s), IndexAt(times, end_s));
  const double falls_g_s = -lines.press_sign * last.slope_g_s;
  const double free_g_s = kFreeSlope * slope_g_s;
  const double noise_g_s =
      last.time_spread_s2 > 0 ? clean.noise_g / std::sqrt(last.time_spread_s2) : 0;
  if (last.count > 2 && falls_g_s > std::max(free_g_s, kEndSignificance * noise_g_s)) {
    return {FindingCode::kStillInContact, falls_g_s,
            std::max(free_g_s, kEndSignificance * noise_g_s)};
  }
  return {};
}

// True if the force was already up halfway between a touch and the halt. If a slow converter or its
// filter hides the collision, the touch found may be noise, long before the bed.
bool IsPressedMidway(const CleanTap& clean, const TapMotion& motion, const TapLines& lines) {
  const double halt_s = motion.approach_end_s - clean.origin_s;
  const auto& times = clean.samples.time_s;
  const double midway_s = 0.5 * (lines.touch.time_s + halt_s);
  const std::size_t at = IndexAt(times, midway_s);
  if (at < 1 || at + 1 >= times.size()) {
    return false;
  }
  const auto& force_g = clean.samples.force_g;
  const double mean_g = (force_g[at - 1] + force_g[at] + force_g[at + 1]) / 3.0;
  const double raised_g = lines.press_sign * (mean_g - lines.touch.force_g);
  return raised_g > kSignificant * clean.noise_g / std::sqrt(3.0) &&
         raised_g > kPressedMidway * std::abs(clean.dwell_g - clean.departure_g);
}

Finding CheckTouch(const TapMotion& motion, const CleanTap& clean, const TapLines& lines,
                   const TapShape& shape, TapAnalysis& result) {
  const double way_mm = kTouchSamples * clean.period_s * motion.approach_speed_mm_s;
  const double noticed_mm = kNoticedTouch * shape.press_depth_mm + way_mm;
  const double max_mm = kMaxTouch * shape.press_depth_mm + way_mm;
  const bool slow = shape.touch_depth_mm > noticed_mm && IsPressedMidway(clean, motion, lines);
  const double max_g = kMaxBaseline * shape.compression_g;
  const double noticed_g =
      std::max(kNoticedBaseline * shape.compression_g, kSignificant * clean.noise_g);
  const double baseline_g = shape.unexplained_baseline_g;
  // The published score accepts either alone; together they indicate plastic on the nozzle.
  if (slow && (shape.touch_depth_mm > max_mm || baseline_g > noticed_g)) {
    return {FindingCode::kSlowCollision, shape.touch_depth_mm,
            shape.touch_depth_mm > max_mm ? max_mm : noticed_mm};
  }
  if (baseline_g > std::max(max_g, kSignificant * clean.noise_g)) {
    return {FindingCode::kBaselineForceInconsistent, baseline_g, max_g};
  }
  if (slow) {
    result.Notice({FindingCode::kSlowCollision, shape.touch_depth_mm, noticed_mm});
  }
  if (baseline_g > noticed_g) {
    result.Notice({FindingCode::kBaselineForceInconsistent, baseline_g, noticed_g});
  }
  return {};
}

Finding CheckShape(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
                   const TapShape& shape, const CheckOptions& options, TapAnalysis& result) {
  if (lines.has_collision && lines.has_break) {
    const double lost = std::max(shape.dwell_ratio, shape.lost_ratio);
    if (lost > kMaxDwell) {
      return {FindingCode::kFouledNozzle, 100 * std::min(lost, 1.0), 100 * kMaxDwell};
    }
    if (const Finding found = CheckTouch(motion, clean, lines, shape, result);
        found.code != FindingCode::kNone) {
      return found;
    }
    if (shape.compression_g < options.trigger_force_g) {
      return {FindingCode::kLowCompressionForce, shape.compression_g, options.trigger_force_g};
    }
    const double left = 100 * shape.decompression_g / shape.compression_g;
    if (left < kMinDecompression) {
      return {FindingCode::kLowDecompressionForce, left, kMinDecompression};
    }
    if (left < kNoticedDecompression) {
      result.Notice({FindingCode::kLowDecompressionForce, left, kNoticedDecompression});
    }
  }
  const double press_g = std::abs(clean.dwell_g - clean.departure_g);
  if (shape.pull_g > kPullSignificance * shape.pull_noise_g &&
      shape.pull_g > kNoticedPull * press_g) {
    const Finding found{FindingCode::kAdhesion, shape.pull_g, kMaxPull * press_g};
    if (shape.pull_g > kMaxPull * press_g) {
      return found;
    }
    result.Notice(found);
  }
  if (result.quality < kMinScore) {
    return {FindingCode::kLowTapQuality, result.quality, kMinScore};
  }
  return {};
}

FindingCode HumCode(double mains_hz) {
  return mains_hz < 55    ? FindingCode::kHum50Hz
         : mains_hz < 80  ? FindingCode::kHum60Hz
         : mains_hz < 110 ? FindingCode::kHum100Hz
                          : FindingCode::kHum120Hz;
}

void NoteSurroundings(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
                      const TapShape& shape, TapAnalysis& result) {
  if (!lines.has_break) {
    return;
  }
  const double press_g = std::abs(clean.dwell_g - clean.departure_g);
  const double width_s = motion.pull_back_end_s - motion.pull_back_start_s;
  const double drift_g_s = std::abs(lines.departure.slope_g_s);
  const double noise_g_s = lines.departure.time_spread_s2 > 0
                               ? lines.departure.Noise() / std::sqrt(lines.departure.time_spread_s2)
                               : 0;
  if (drift_g_s > std::max(kNoticedDrift * press_g / width_s, kSignificant * noise_g_s)) {
    result.Notice({FindingCode::kDrift, drift_g_s, kNoticedDrift * press_g / width_s});
  }
  const Hum hum =
      FindHum(clean.samples, lines.break_at, lines.departure_end, lines.departure, clean.period_s);
  if (hum.mains_hz > 0) {
    result.Notice({HumCode(hum.mains_hz), hum.amplitude_g, hum.seen_hz});
  }
  if (shape.press_depth_mm < kMinPressDepth_mm) {
    result.Notice({FindingCode::kShortPress, shape.press_depth_mm, kMinPressDepth_mm});
  }
}

}  // namespace

Finding CheckTap(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
                 const CheckOptions& options, TapAnalysis& result) {
  const TapShape shape = MeasureShape(clean, motion, lines);
  result.quality = Score(shape, options.decompression_angle_rad);
  Finding refusal = CheckSamples(clean, motion, lines, result);
  const auto first = [&refusal](const Finding& found) {
    refusal = refusal.code == FindingCode::kNone ? found : refusal;
  };
  if (refusal.code == FindingCode::kNone) {
    first(CheckPress(clean, motion, lines));
  }
  if (options.nozzle_temperature_c > kMaxNozzle_c) {
    result.Notice({FindingCode::kHotNozzle, options.nozzle_temperature_c, kMaxNozzle_c});
  }
  if (refusal.code == FindingCode::kNone) {
    first(CheckShape(clean, motion, lines, shape, options, result));
    NoteSurroundings(clean, motion, lines, shape, result);
  }
  return refusal;
}

}  // namespace trammel::tap
