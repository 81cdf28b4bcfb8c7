#include "tap/two_line/tap_lines.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

constexpr std::size_t kMinOfLine = 2;
constexpr std::size_t kMinOfHalf = 3;  // so that a half has a residual
constexpr double kBreakWidths = 1.5;   // pull-back widths from its cruise's start: as published

void FindCollision(const Samples& samples, double halt_s, double width_s, TapLines& lines) {
  lines.approach_first = IndexAt(samples.time_s, halt_s - width_s);
  const std::size_t halt = IndexAt(samples.time_s, halt_s);
  lines.collision = FindElbow(samples, lines.approach_first, halt, kMinOfLine);
  if (lines.collision >= halt) {
    return;
  }
  const std::size_t end =
      std::min(lines.pull_back, IndexAt(samples.time_s, samples.time_s[lines.collision] + width_s));
  lines.dwell_first = FindElbow(samples, lines.collision, end, kMinOfLine);
  if (lines.dwell_first >= end) {
    return;
  }
  lines.approach = FitLine(samples, lines.approach_first, lines.collision);
  lines.compression = FitLine(samples, lines.collision, lines.dwell_first);
  lines.dwell = FitLine(samples, lines.dwell_first, lines.pull_back);
  lines.touch = Intersect(lines.approach, lines.compression);
  lines.press_end = Intersect(lines.compression, lines.dwell);
  lines.has_collision = true;
}

// Splits where the force passes the middle of its range, by the count of samples above it. A noisy
// sample near the middle shifts that by one only, unlike the first crossing.
void SplitDecompression(const Samples& samples, TapLines& lines) {
  const auto forces = samples.force_g.subspan(lines.decompression_first,
                                              lines.break_at - lines.decompression_first);
  const auto [lowest, highest] = std::minmax_element(forces.begin(), forces.end());
  const float middle = 0.5F * (*lowest + *highest);
  const auto above = static_cast<std::size_t>(
      std::count_if(forces.begin(), forces.end(), [middle](float f) { return f > middle; }));
  const std::size_t upper = lines.press_sign > 0 ? above : forces.size() - above;
  lines.split_at = lines.decompression_first + upper;
  const double noise_g = lines.departure.Noise();
  lines.split_reach = noise_g > 0 ? 0.5 * (*highest - *lowest) / noise_g : kSplitNoise;
  lines.is_split = lines.split_reach >= kSplitNoise && upper >= kMinOfHalf &&
                   forces.size() - upper >= kMinOfHalf;
}

void FindBreak(const Samples& samples, double cruise_s, double width_s, TapLines& lines) {
  lines.decompression_first = IndexAt(samples.time_s, cruise_s);
  lines.departure_end = IndexAt(samples.time_s, cruise_s + kBreakWidths * width_s);
  lines.break_at = FindElbow(samples, lines.decompression_first, lines.departure_end, kMinOfLine);
  if (lines.break_at >= lines.departure_end) {
    return;
  }
  lines.departure = FitLine(samples, lines.break_at, lines.departure_end);
  lines.whole = FitLine(samples, lines.decompression_first, lines.break_at);
  SplitDecompression(samples, lines);
  lines.upper =
      lines.is_split ? FitLine(samples, lines.decompression_first, lines.split_at) : lines.whole;
  lines.decompression =
      lines.is_split ? FitLine(samples, lines.split_at, lines.break_at) : lines.whole;
  if (lines.is_split) {
    // Halves of a straight press are parallel and cross anywhere.
    const double split_s = samples.time_s[lines.split_at];
    const Crossing crossing = Intersect(lines.upper, lines.decompression);
    const bool inside = crossing.time_s > samples.time_s[lines.decompression_first] &&
                        crossing.time_s < samples.time_s[lines.break_at];
    lines.split = inside ? crossing : Crossing{split_s, lines.whole.Force(split_s), 0};
  }
  lines.let_go = Intersect(lines.decompression, lines.departure);
  lines.has_break = true;
}

}  // namespace

TapLines FindTapLines(const CleanTap& clean, const TapMotion& motion) {
  TapLines lines;
  const Samples& samples = clean.samples;
  lines.press_sign = clean.dwell_g < clean.departure_g ? -1 : 1;
  const double width_s = motion.pull_back_end_s - motion.pull_back_start_s;
  lines.pull_back = IndexAt(samples.time_s, 0);
  if (motion.has_approach) {
    FindCollision(samples, motion.approach_end_s - clean.origin_s, width_s, lines);
  }
  FindBreak(samples, motion.cruise_start_s - clean.origin_s, width_s, lines);
  if (lines.has_collision && lines.has_break) {
    lines.dwell_end = Intersect(lines.dwell, lines.upper);
  }
  return lines;
}

}  // namespace trammel::tap
