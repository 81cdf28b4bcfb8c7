#include "sim/cell/tap_moves.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "sim/print/field_bound.h"

namespace trammel::sim {
namespace {

// A start, a cruise and, unless the move is cut short, an end, over a distance.
void AppendTrapezoid(std::vector<ZMove>& moves, double time_s, double z_mm, double direction,
                     double distance_mm, double speed_mm_s, double acceleration_mm_s2,
                     bool has_end) {
  const double ramps = has_end ? 2 : 1;
  const double reached_mm_s =
      std::min(speed_mm_s, std::sqrt(2 * acceleration_mm_s2 * distance_mm / ramps));
  const double ramp_s = reached_mm_s / acceleration_mm_s2;
  const double ramp_mm = 0.5 * reached_mm_s * ramp_s;
  const double cruise_s = std::max(0.0, distance_mm - ramps * ramp_mm) / reached_mm_s;
  moves.push_back({time_s, ramp_s, 0, acceleration_mm_s2, z_mm, direction});
  time_s += ramp_s;
  z_mm += direction * ramp_mm;
  if (cruise_s > 0) moves.push_back({time_s, cruise_s, reached_mm_s, 0, z_mm, direction});
  time_s += cruise_s;
  z_mm += direction * reached_mm_s * cruise_s;
  if (has_end) {
    moves.push_back({time_s, ramp_s, reached_mm_s, -acceleration_mm_s2, z_mm, direction});
  }
}

}  // namespace

Result<void> Validate(const TapMotion& m) {
  return CheckBounds("tap motion", {{"approach_speed_mm_s", m.approach_speed_mm_s, 0.05, 50},
                                    {"acceleration_mm_s2", m.acceleration_mm_s2, 1, 1e5},
                                    {"approach_from_mm", m.approach_from_mm, 0.02, 100},
                                    {"trigger_force_g", m.trigger_force_g, 1, 1e5},
                                    {"stop_latency_s", m.stop_latency_s, 0, 0.5},
                                    {"told_after_s", m.told_after_s, 0, 5},
                                    {"pause_s", m.pause_s, 0, 5},
                                    {"pull_back_mm", m.pull_back_mm, 0.005, 5},
                                    {"pull_back_speed_mm_s", m.pull_back_speed_mm_s, 0.005, 20}});
}

std::vector<ZMove> ApproachMoves(const TapMotion& motion, double start_time_s, double start_z_mm,
                                 double halt_z_mm) {
  TRAMMEL_CHECK(start_z_mm > halt_z_mm, "start_z_mm = {}, halt_z_mm = {}", start_z_mm, halt_z_mm);
  std::vector<ZMove> moves;
  AppendTrapezoid(moves, start_time_s, start_z_mm, -1, start_z_mm - halt_z_mm,
                  motion.approach_speed_mm_s, motion.acceleration_mm_s2, false);
  return moves;
}

std::vector<ZMove> PullBackMoves(const TapMotion& motion, double stop_time_s, double halt_z_mm) {
  const double told_s = stop_time_s + motion.told_after_s;
  std::vector<ZMove> moves = {{told_s, 0, 0, 0, halt_z_mm, 0}};
  AppendTrapezoid(moves, told_s + motion.pause_s, halt_z_mm, 1, motion.pull_back_mm,
                  motion.pull_back_speed_mm_s, motion.acceleration_mm_s2, true);
  return moves;
}

ZState StateAt(std::span<const ZMove> moves, double time_s) {
  TRAMMEL_CHECK(!moves.empty(), "moves = 0");
  const auto after =
      std::upper_bound(moves.begin(), moves.end(), time_s,
                       [](double t, const ZMove& move) { return t < move.start_time_s; });
  if (after == moves.begin()) return {moves.front().start_z_mm, 0};
  const ZMove& move = *std::prev(after);
  const double dt = std::min(time_s - move.start_time_s, move.duration_s);
  const double speed = move.start_velocity_mm_s + move.acceleration_mm_s2 * dt;
  const bool moving = time_s - move.start_time_s < move.duration_s;
  return {move.start_z_mm + move.z_direction * dt *
                                (move.start_velocity_mm_s + 0.5 * move.acceleration_mm_s2 * dt),
          moving ? move.z_direction * speed : 0};
}

}  // namespace trammel::sim
