#include "pressure_advance/timing/sweep_positions.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

/// Times are sums of durations; consecutive moves may have rounding gaps.
constexpr double kTouch_s = 1e-6;

double EndOf(const LineMove& move) { return move.start_s + move.duration_s; }

double SpeedIn(const LineMove& move, double time_s) {
  return move.start_speed_mm_s + move.acceleration_mm_s2 * (time_s - move.start_s);
}

/// Returns the last move that begins at or before the time, or null.
const LineMove* MoveBefore(std::span<const LineMove> moves, double time_s) {
  const auto after = std::upper_bound(moves.begin(), moves.end(), time_s,
                                      [](double t, const LineMove& m) { return t < m.start_s; });
  return after == moves.begin() ? nullptr : &*(after - 1);
}

}  // namespace

std::vector<LineMove> TrapezoidSweep(double start_s, double start_mm, double end_mm,
                                     double speed_mm_s, double acceleration_mm_s2) {
  const double length_mm = std::abs(end_mm - start_mm);
  TRAMMEL_CHECK(speed_mm_s > 0 && acceleration_mm_s2 > 0 &&
                    length_mm * acceleration_mm_s2 >= speed_mm_s * speed_mm_s,
                "{} mm/s at {} mm/s2 over {} mm", speed_mm_s, acceleration_mm_s2, length_mm);
  const double sign = end_mm > start_mm ? 1 : -1;
  const double ramp_s = speed_mm_s / acceleration_mm_s2;
  const double ramp_mm = 0.5 * speed_mm_s * ramp_s;
  const double cruise_s = (length_mm - 2 * ramp_mm) / speed_mm_s;
  std::vector<LineMove> moves;
  moves.push_back({start_s, ramp_s, start_mm, 0, sign * acceleration_mm_s2});
  if (cruise_s > 0) {
    moves.push_back({start_s + ramp_s, cruise_s, start_mm + sign * ramp_mm, sign * speed_mm_s, 0});
  }
  moves.push_back({start_s + ramp_s + cruise_s, ramp_s, end_mm - sign * ramp_mm, sign * speed_mm_s,
                   -sign * acceleration_mm_s2});
  return moves;
}

HeadState HeadAt(std::span<const LineMove> moves, double time_s) {
  TRAMMEL_CHECK(!moves.empty(), "no moves at {} s", time_s);
  const LineMove* move = MoveBefore(moves, time_s);
  if (move == nullptr) return {moves.front().start_mm, 0, true};
  const double in_move_s = std::min(time_s - move->start_s, move->duration_s);
  HeadState state;
  state.position_mm = move->start_mm + in_move_s * (move->start_speed_mm_s +
                                                    0.5 * move->acceleration_mm_s2 * in_move_s);
  state.standing = time_s > EndOf(*move) + kTouch_s;
  if (!state.standing) state.speed_mm_s = SpeedIn(*move, move->start_s + in_move_s);
  return state;
}

double MotionEnd_s(std::span<const LineMove> moves) { return EndOf(moves.back()); }

double LargestSpeed_mm_s(std::span<const LineMove> moves) {
  double largest = 0;
  for (const LineMove& move : moves) {
    largest =
        std::max({largest, std::abs(move.start_speed_mm_s), std::abs(SpeedIn(move, EndOf(move)))});
  }
  return largest;
}

bool StandsWithin(std::span<const LineMove> moves, double from_s, double to_s) {
  double covered_s = from_s;
  for (const LineMove& move : moves) {
    if (EndOf(move) < covered_s) continue;
    if (move.start_s > covered_s + kTouch_s) return true;
    covered_s = EndOf(move);
    if (covered_s >= to_s) return false;
  }
  return covered_s + kTouch_s < to_s;
}

bool IsSteady(std::span<const LineMove> moves, double from_s, double to_s, double tolerance) {
  if (StandsWithin(moves, from_s, to_s)) return false;
  const double least = (1 - tolerance) * LargestSpeed_mm_s(moves);
  for (const LineMove& move : moves) {
    const double begin_s = std::max(from_s, move.start_s);
    const double end_s = std::min(to_s, EndOf(move));
    if (end_s < begin_s) continue;
    // Speed is linear within a move, so its minimum is at an end; a reversal within shows as a
    // small sum.
    const double first = SpeedIn(move, begin_s);
    const double last = SpeedIn(move, end_s);
    if (end_s - begin_s <= kTouch_s && to_s - from_s > kTouch_s) continue;
    if (first * last <= 0 || std::min(std::abs(first), std::abs(last)) < least) return false;
  }
  return true;
}

namespace {

/// Returns the mean absolute difference of two frames, grey levels.
double Difference(const Frame& a, const Frame& b) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < a.bgr.size(); ++i) {
    sum += static_cast<std::uint64_t>(std::abs(int{a.bgr[i]} - int{b.bgr[i]}));
  }
  return static_cast<double>(sum) / static_cast<double>(std::max<std::size_t>(1, a.bgr.size()));
}

/// Counts the leading still pairs: the longest run whose largest difference is below half of that
/// of nine in ten of the pairs after it. At most half of the sweep. REQUIRES a pair.
std::size_t StillRun(std::span<const double> differences) {
  std::size_t still = 0;
  double largest = 0;
  const double most = 0.5 * *std::max_element(differences.begin(), differences.end());
  for (std::size_t run = 1; run <= differences.size() / 2; ++run) {
    largest = std::max(largest, differences[run - 1]);
    if (largest >= most) break;
    if (largest < 0.5 * Quantile(differences.subspan(run), 0.1)) {
      still = run;
    }
  }
  return still;
}

double OnLine(const std::vector<double>& positions, double length_mm) {
  const auto on = std::count_if(positions.begin(), positions.end(),
                                [&](double p) { return p >= -1e-9 && p <= length_mm + 1e-9; });
  return static_cast<double>(on);
}

}  // namespace

StillFrames FindStillFrames(std::span<const Frame> frames, std::span<const std::size_t> order) {
  StillFrames still;
  if (order.size() < 2) {
    return still;
  }
  std::vector<double> differences;
  for (std::size_t i = 1; i < order.size(); ++i) {
    differences.push_back(Difference(frames[order[i - 1]], frames[order[i]]));
  }
  still.all = *std::max_element(differences.begin(), differences.end()) == 0;
  if (still.all) {
    return still;
  }
  still.first = StillRun(differences);
  std::vector<double> backwards(differences.rbegin(), differences.rend());
  backwards.resize(backwards.size() - still.first);
  still.last = StillRun(backwards);
  // Without the tail's still pairs the leading ones may be clearer.
  differences.resize(differences.size() - still.last);
  still.first = std::max(still.first, StillRun(differences));
  return still;
}

std::vector<std::size_t> PlacedFrames(const ScanLine& line, std::size_t frame_count) {
  const auto& positions = line.frame_positions_mm;
  TRAMMEL_CHECK(positions.empty() || positions.size() == frame_count, "{} positions for {} frames",
                positions.size(), frame_count);
  std::vector<std::size_t> placed;
  for (std::size_t i = 0; i < frame_count; ++i) {
    if (positions.empty() || positions[i]) {
      placed.push_back(i);
    }
  }
  return placed;
}

bool SweepsBackwards(const ScanLine& line) {
  if (const auto& positions = line.frame_positions_mm; !positions.empty()) {
    const std::vector<std::size_t> placed = PlacedFrames(line, positions.size());
    return !placed.empty() && *positions[placed.back()] < *positions[placed.front()];
  }
  const AxisDirection print = line.print_direction.value_or(AxisDirection::kPlusX);
  return line.sweep_direction.value_or(print) != print;
}

std::vector<double> SweepPositions(const Scan& scan, const ScanLine& line, std::size_t frame_count,
                                   std::size_t begin) {
  TRAMMEL_CHECK(line.frame_times_s.empty() || line.frame_times_s.size() == frame_count,
                "{} times for {} frames", line.frame_times_s.size(), frame_count);
  TRAMMEL_CHECK(begin < frame_count, "begin = {}, {} frames", begin, frame_count);
  const double sign = SweepsBackwards(line) ? -1 : 1;
  const auto positions = [&](double start_mm) {
    std::vector<double> result;
    for (std::size_t i = 0; i < frame_count; ++i) {
      const double elapsed_s =
          line.frame_times_s.empty()
              ? (static_cast<double>(i) - static_cast<double>(begin)) / scan.frames_per_s
              : line.frame_times_s[i] - line.frame_times_s[begin];
      result.push_back(start_mm + sign * scan.scan_speed_mm_s * elapsed_s);
    }
    return result;
  };
  std::vector<double> from_start = positions(scan.line_start_mm);
  if (sign > 0) {
    return from_start;
  }
  const double length_mm = scan.motion.length_mm.value_or(0);
  std::vector<double> from_end = positions(length_mm - scan.line_start_mm);
  return OnLine(from_end, length_mm) > OnLine(from_start, length_mm) ? from_end : from_start;
}

}  // namespace trammel::pressure_advance
