#include "tap/samples/motion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tap/samples/finding.h"

namespace trammel::tap {

namespace {

// Limits of any printer's moves; they keep arithmetic on hostile numbers finite.
constexpr double kMaxTime_s = 1e9;
constexpr double kMaxLength_mm = 1e5;
constexpr double kMaxSpeed_mm_s = 1e5;
constexpr double kMaxAcceleration_mm_s2 = 1e8;
// Minimum gap between separate movements: moves of a queue follow each other to the clock's tick.
constexpr double kGap_s = 1e-3;
// Largest change of a cruise's speed: rounding in a file, not an acceleration.
constexpr double kCruiseSpeedChange = 0.01;

bool IsSane(const Move& move) {
  const double end_speed = move.start_velocity_mm_s + move.acceleration_mm_s2 * move.duration_s;
  return std::abs(move.start_time_s) <= kMaxTime_s && move.duration_s >= 0 &&
         move.duration_s <= kMaxTime_s && std::abs(move.start_velocity_mm_s) <= kMaxSpeed_mm_s &&
         std::abs(move.acceleration_mm_s2) <= kMaxAcceleration_mm_s2 &&
         std::abs(end_speed) <= kMaxSpeed_mm_s && std::abs(move.start_z_mm) <= kMaxLength_mm &&
         std::abs(move.z_direction) <= 1.0001;
}

double ZAt(const Move& move, double dt_s) {
  return move.start_z_mm + move.z_direction *
                               (move.start_velocity_mm_s + 0.5 * move.acceleration_mm_s2 * dt_s) *
                               dt_s;
}

bool IsCruise(const Move& move) {
  return move.start_velocity_mm_s * std::abs(move.z_direction) > 0 && move.duration_s > 0 &&
         std::abs(move.acceleration_mm_s2) * move.duration_s <=
             kCruiseSpeedChange * move.start_velocity_mm_s;
}

struct Group {
  std::size_t first = 0;
  std::size_t end = 0;
};

// Returns the last consecutive moves in a direction before `end`.
Group LastGroup(std::span<const Move> moves, std::size_t end, double direction) {
  std::size_t last = end;
  while (last > 0 && moves[last - 1].z_direction * direction <= 0) {
    --last;
  }
  std::size_t first = last;
  while (first > 0 && moves[first - 1].z_direction * direction > 0 &&
         (first == last || std::abs(moves[first].start_time_s - moves[first - 1].start_time_s -
                                    moves[first - 1].duration_s) <= kGap_s)) {
    --first;
  }
  return {first, last};
}

// Returns the longest cruise of a group, or its end if there is none.
std::size_t FindCruise(std::span<const Move> moves, Group group) {
  std::size_t found = group.end;
  for (std::size_t i = group.first; i < group.end; ++i) {
    if (IsCruise(moves[i]) &&
        (found == group.end || moves[i].duration_s > moves[found].duration_s)) {
      found = i;
    }
  }
  return found;
}

void ReadPullBack(std::span<const Move> moves, Group group, std::size_t cruise_index,
                  TapMotion& motion) {
  const Move& first = moves[group.first];
  const Move& cruise = moves[cruise_index];
  const Move& last = moves[group.end - 1];
  motion.pull_back_start_s = first.start_time_s;
  motion.halt_z_mm = first.start_z_mm;
  motion.cruise_start_s = cruise.start_time_s;
  motion.cruise_end_s = cruise.start_time_s + cruise.duration_s;
  motion.cruise_start_z_mm = cruise.start_z_mm;
  motion.cruise_end_z_mm = ZAt(cruise, cruise.duration_s);
  motion.pull_back_speed_mm_s = cruise.start_velocity_mm_s * cruise.z_direction;
  motion.pull_back_end_s = last.start_time_s + last.duration_s;
  motion.end_z_mm = ZAt(last, last.duration_s);
  motion.acceleration_mm_s2 = cruise_index == group.first ? 0 : first.acceleration_mm_s2;
  motion.deceleration_mm_s2 = cruise_index + 1 == group.end ? 0 : -last.acceleration_mm_s2;
}

void ReadApproach(std::span<const Move> moves, std::size_t pull_back, TapMotion& motion) {
  const Group group = LastGroup(moves, pull_back, -1);
  const std::size_t index = FindCruise(moves, group);
  if (index == group.end) {
    return;
  }
  const Move& cruise = moves[index];
  const double speed = -cruise.start_velocity_mm_s * cruise.z_direction;
  const double end_s = cruise.start_time_s + (cruise.start_z_mm - motion.halt_z_mm) / speed;
  // An approach that would have to end after the pull-back's start belongs to another tap.
  if (end_s < cruise.start_time_s || end_s > motion.pull_back_start_s) {
    return;
  }
  motion.has_approach = true;
  motion.approach_start_s = cruise.start_time_s;
  motion.approach_start_z_mm = cruise.start_z_mm;
  motion.approach_speed_mm_s = speed;
  motion.approach_end_s = end_s;
}

}  // namespace

double TapMotion::Z(double time_s) const {
  if (time_s < pull_back_start_s) {
    return has_approach && time_s < approach_end_s
               ? approach_start_z_mm - approach_speed_mm_s * (time_s - approach_start_s)
               : halt_z_mm;
  }
  if (time_s < cruise_start_s) {
    const double dt = time_s - pull_back_start_s;
    return std::min(halt_z_mm + 0.5 * acceleration_mm_s2 * dt * dt, cruise_start_z_mm);
  }
  if (time_s < cruise_end_s) {
    return CruiseZ(time_s);
  }
  const double to_end = std::max(0.0, pull_back_end_s - time_s);
  return std::max(cruise_end_z_mm, end_z_mm - 0.5 * deceleration_mm_s2 * to_end * to_end);
}

Finding FindMotion(std::span<const Move> moves, TapMotion& motion) {
  motion = {};
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (!IsSane(moves[i]) || (i > 0 && moves[i].start_time_s < moves[i - 1].start_time_s)) {
      return {FindingCode::kAbsurdMoves, static_cast<double>(i + 1), 0};
    }
  }
  const Group up = LastGroup(moves, moves.size(), +1);
  if (up.first == up.end) {
    return {FindingCode::kMissingMoves, static_cast<double>(moves.size()), 1};
  }
  const std::size_t cruise = FindCruise(moves, up);
  if (cruise == up.end) {
    return {FindingCode::kNoCruise, 0, 1};
  }
  ReadPullBack(moves, up, cruise, motion);
  ReadApproach(moves, up.first, motion);
  return {};
}

namespace {

// Minimum number of samples. The simplest model of a break has four unknowns: its place, two of the
// baseline, one of the press; one more sample determines the noise.
constexpr std::size_t kMinSamples = 5;
// Largest part of the pull-back's cruise before or after the samples.
constexpr double kMaxOutside = 0.5;
constexpr double kMaxForce_g = 1e12;  // counts of a 32-bit converter, not yet scaled, lie below

Finding CheckSamples(const TapView& tap) {
  std::size_t not_finite = 0;
  std::size_t unsorted = 0;
  for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
    // Negated so that NaN counts.
    const bool finite =
        std::abs(tap.time_s[i]) <= kMaxTime_s && std::abs(tap.force_g[i]) <= kMaxForce_g;
    not_finite += finite ? 0 : 1;
    unsorted += i > 0 && tap.time_s[i] < tap.time_s[i - 1] ? 1 : 0;
  }
  if (not_finite > 0) {
    return {FindingCode::kNotFinite, static_cast<double>(not_finite), 0};
  }
  if (unsorted > 0) {
    return {FindingCode::kUnsortedTimes, static_cast<double>(unsorted), 0};
  }
  return {};
}

}  // namespace

Finding CheckInput(const TapView& tap, TapMotion& motion) {
  const std::size_t n = std::min(tap.time_s.size(), tap.force_g.size());
  if (n < kMinSamples || tap.time_s.size() != tap.force_g.size()) {
    return {FindingCode::kNoSamples, static_cast<double>(n), kMinSamples};
  }
  if (n > kMaxSamples) {
    return {FindingCode::kTooManySamples, static_cast<double>(n), kMaxSamples};
  }
  if (const Finding found = CheckSamples(tap); found.code != FindingCode::kNone) {
    return found;
  }
  if (tap.moves.size() > kMaxMoves) {
    return {FindingCode::kAbsurdMoves, static_cast<double>(tap.moves.size()), kMaxMoves};
  }
  if (const Finding found = FindMotion(tap.moves, motion); found.code != FindingCode::kNone) {
    return found;
  }
  const double cruise_s = motion.cruise_end_s - motion.cruise_start_s;
  const double covered_s = std::min(tap.time_s.back(), motion.cruise_end_s) -
                           std::max(tap.time_s.front(), motion.cruise_start_s);
  const double outside_s = cruise_s - std::max(0.0, covered_s);
  if (outside_s > kMaxOutside * cruise_s) {
    return {FindingCode::kMovesOutside, outside_s, kMaxOutside * cruise_s};
  }
  return {};
}

}  // namespace trammel::tap
