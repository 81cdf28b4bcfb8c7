#include "tap/two_line/two_line.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kMinMoves = 5;
constexpr std::size_t kMaxProbingMoves = 6;  // including the approach's acceleration
constexpr std::size_t kMinApproach = 4;
constexpr std::size_t kMinDecompression = 3;
constexpr double kLatestBreak = 0.75;       // of the pull-back
constexpr double kTimeResolution_s = 1e-7;  // resolution of 0.5 s in single precision

Finding CheckMoves(std::span<const Move> moves) {
  if (moves.size() < kMinMoves) {
    return {FindingCode::kTooFewProbingMoves, static_cast<double>(moves.size()), kMinMoves};
  }
  if (moves.size() > kMaxProbingMoves) {
    return {FindingCode::kTooManyProbingMoves, static_cast<double>(moves.size()), kMaxProbingMoves};
  }
  const double acceleration = moves[moves.size() - kMinMoves].acceleration_mm_s2;
  if (acceleration != 0) {
    return {FindingCode::kCoastingMoveAcceleration, std::abs(acceleration), 0};
  }
  return {};
}

Finding CheckLines(const TapLines& lines) {
  if (!lines.has_collision) {
    return {FindingCode::kApproachUnknown,
            static_cast<double>(lines.collision - std::min(lines.collision, lines.approach_first)),
            kMinApproach};
  }
  const std::size_t in_decompression =
      lines.has_break ? lines.decompression.count : lines.break_at - lines.decompression_first;
  if (!lines.has_break || in_decompression < kMinDecompression) {
    return {FindingCode::kFewDecompressionSamples, static_cast<double>(in_decompression),
            kMinDecompression};
  }
  const std::array<double, 4> times = {lines.touch.time_s, lines.press_end.time_s,
                                       lines.dwell_end.time_s, lines.let_go.time_s};
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (!(times[i] > times[i - 1])) {
      return {FindingCode::kTapChronology, static_cast<double>(i + 2), 0};
    }
  }
  // Signs + - - + for a press that adds force, or their mirror image.
  const std::array<double, 5> slopes = {lines.approach.slope_g_s, lines.compression.slope_g_s,
                                        lines.dwell.slope_g_s, lines.upper.slope_g_s,
                                        lines.departure.slope_g_s};
  constexpr std::array<double, 4> kTurns = {1, -1, -1, 1};
  for (std::size_t i = 0; i < kTurns.size(); ++i) {
    if (!((slopes[i + 1] - slopes[i]) * kTurns[i] * lines.press_sign > 0)) {
      return {FindingCode::kTapShapeInvalid, static_cast<double>(i + 2), 0};
    }
  }
  return {};
}

Finding CheckBreak(const CleanTap& clean, const TapMotion& motion, const TapLines& lines) {
  const double break_s = lines.let_go.time_s;
  const double cruise_s = motion.cruise_start_s - clean.origin_s;
  const double end_s = motion.pull_back_end_s - clean.origin_s;
  if (!(break_s > cruise_s)) {
    return {FindingCode::kTapBreakContactTooEarly, break_s, cruise_s};
  }
  if (!(break_s < end_s)) {
    return {FindingCode::kTapBreakContactTooLate, break_s, end_s};
  }
  if (break_s > kLatestBreak * end_s) {
    return {FindingCode::kTapPullbackTooShort, 100 * break_s / end_s, 100 * kLatestBreak};
  }
  return {};
}

void AddPoint(Corner corner, const Crossing& at, const CleanTap& clean, const TapMotion& motion,
              TapAnalysis& result) {
  if (result.point_count < TapAnalysis::kMaxPoints && std::isfinite(at.time_s)) {
    const double time_s = clean.origin_s + at.time_s;
    result.points[result.point_count++] = {corner, time_s, motion.Z(time_s),
                                           clean.origin_g + at.force_g};
  }
}

}  // namespace

void SetPoints(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
               TapAnalysis& result) {
  result.point_count = 0;
  if (lines.has_collision) {
    const double start_s = clean.samples.time_s[lines.approach_first];
    AddPoint(Corner::kApproachStart, {start_s, lines.approach.Force(start_s), 0}, clean, motion,
             result);
    AddPoint(Corner::kCollision, lines.touch, clean, motion, result);
    AddPoint(Corner::kPressEnd, lines.press_end, clean, motion, result);
  }
  if (lines.has_break) {
    if (lines.has_collision) {
      AddPoint(Corner::kDwellEnd, lines.dwell_end, clean, motion, result);
    }
    if (lines.is_split) {
      AddPoint(Corner::kDecompressionSplit, lines.split, clean, motion, result);
    }
    AddPoint(Corner::kBreak, lines.let_go, clean, motion, result);
    const double end_s = motion.pull_back_end_s - clean.origin_s;
    AddPoint(Corner::kPullBackEnd, {end_s, lines.departure.Force(end_s), 0}, clean, motion, result);
  }
}

void JudgeTwoLine(std::span<const Move> moves, const CleanTap& clean, const TapMotion& motion,
                  const TapLines& lines, const TapOptions& options, TapAnalysis& result) {
  SetPoints(clean, motion, lines, result);
  result.noise_g = lines.departure.Noise();
  Finding reason = CheckMoves(moves);
  if (reason.code == FindingCode::kNone) {
    reason = CheckLines(lines);
  }
  if (reason.code == FindingCode::kNone) {
    reason = CheckBreak(clean, motion, lines);
  }
  if (reason.code != FindingCode::kNone) {
    result.verdict = Verdict::kRefused;
    result.reason = reason;
    return;
  }
  if (!lines.is_split) {
    result.Notice({FindingCode::kDecompressionNotSplit, lines.split_reach, kSplitNoise});
  }
  result.verdict = Verdict::kGood;
  result.reason = {};
  result.latency_s = std::isnan(options.latency_s) ? 0 : options.latency_s;
  result.latency_uncertainty_s = options.latency_uncertainty_s;
  result.contact_time_s = clean.origin_s + lines.let_go.time_s - result.latency_s;
  result.contact_mm.value = motion.Z(result.contact_time_s);
  const double degrees = static_cast<double>(lines.decompression.count) - 2;
  result.contact_mm.standard_uncertainty =
      motion.pull_back_speed_mm_s * std::hypot(lines.let_go.standard_uncertainty_s,
                                               options.latency_uncertainty_s, kTimeResolution_s);
  const double half_mm = Student95(std::max(degrees, 2.0)) * result.contact_mm.standard_uncertainty;
  result.contact_mm.interval95 = {result.contact_mm.value - half_mm,
                                  result.contact_mm.value + half_mm};
}

}  // namespace trammel::tap
