#include "pressure_advance/timing/sweep_motion.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace trammel::pressure_advance {
namespace {

/// Times are sums of durations; moves that touch may miss each other by rounding.
constexpr double kTouch_s = 1e-6;

double EndOf(const LineMove& move) { return move.start_s + move.duration_s; }

double SpeedIn(const LineMove& move, double time_s) {
  return move.start_speed_mm_s + move.acceleration_mm_s2 * (time_s - move.start_s);
}

/// The last move that begins at or before the time, or null.
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
    // Speed is linear within a move, so its least is at an end; a turn within shows as a small sum.
    const double first = SpeedIn(move, begin_s);
    const double last = SpeedIn(move, end_s);
    if (end_s - begin_s <= kTouch_s && to_s - from_s > kTouch_s) continue;
    if (first * last <= 0 || std::min(std::abs(first), std::abs(last)) < least) return false;
  }
  return true;
}

}  // namespace trammel::pressure_advance
