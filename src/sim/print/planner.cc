#include "sim/print/planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trammel::sim {
namespace {

// Klipper's instantaneous_corner_velocity: a sudden change of filament speed that needs no ramp.
constexpr double kFilamentStepMmS = 1;
// Moves straighter or sharper than this cosine count as exactly straight or reversed.
constexpr double kStraightCosine = 0.999999;
constexpr double kNoPeak = std::numeric_limits<double>::infinity();
// Maximum dwell: nothing moves, and no hot end oozes for longer.
constexpr double kLongestDwellS = 2;

// Look-ahead data of one move. v2: squares of speeds, mm^2/s^2.
struct Node {
  std::array<double, 3> direction{};  // unit, 0 where only filament moves
  double filament_per_mm = 0;
  bool moves_head = false;
  double length_mm = 0;
  double cruise_v2 = 0;         // upper bound
  double change_v2 = 0;         // reachable change of v2 over the length
  double smooth_change_v2 = 0;  // the same with the acceleration that spares short zigzags
  double entry_v2 = 0;          // upper bound, then result
  double smooth_entry_v2 = 0;
};

Node MakeNode(const Move& move) {
  Node node;
  const std::array<double, 3> delta = {move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                                       move.to.z_mm - move.from.z_mm};
  const double path_mm = std::hypot(delta[0], delta[1], delta[2]);
  node.moves_head = path_mm > 1e-9;
  node.length_mm = node.moves_head ? path_mm : std::abs(move.e_mm);
  if (node.moves_head) {
    for (std::size_t i = 0; i < 3; ++i) node.direction[i] = delta[i] / path_mm;
    node.filament_per_mm = move.e_mm / path_mm;
  }
  node.cruise_v2 = move.feed_mm_s * move.feed_mm_s;
  node.change_v2 = 2 * node.length_mm * move.acceleration_mm_s2;
  node.smooth_change_v2 = node.change_v2 * (1 - move.minimum_cruise_ratio);
  return node;
}

// Returns the square of the speed at which the path may pass from one move into the next.
double JunctionV2(const Node& before, const Node& after, const Move& before_move,
                  const Move& after_move) {
  if (!before.moves_head || !after.moves_head) {
    return 0;
  }
  double limit = std::min(before.cruise_v2, after.cruise_v2);
  const double filament_change = std::abs(after.filament_per_mm - before.filament_per_mm);
  if (filament_change > 0) {
    const double v = kFilamentStepMmS / filament_change;
    limit = std::min(limit, v * v);
  }
  double cosine = 0;  // of the turn: 1 is straight
  for (std::size_t i = 0; i < 3; ++i) cosine += before.direction[i] * after.direction[i];
  if (cosine < -kStraightCosine) {
    return 0;
  }
  if (cosine > kStraightCosine) {
    return limit;
  }
  // The path rounds the corner on an arc within the junction deviation: v^2 = a r with r = jd
  // sin(t/2) / (1 - sin(t/2)), t the angle between the two strokes, and jd such that a right angle
  // is passed at the square corner velocity.
  const double half_sine = std::sqrt(0.5 * (1 + cosine));
  const double half_cosine = std::sqrt(0.5 * (1 - cosine));
  const double corner = half_sine / (1 - half_sine) * (std::sqrt(2.0) - 1);
  for (const Move* move : {&before_move, &after_move}) {
    limit = std::min(limit, corner * move->corner_velocity_mm_s * move->corner_velocity_mm_s);
  }
  // The arc must not be longer than the shorter of its strokes.
  const double tangent = half_sine / half_cosine;
  limit = std::min(limit, 0.25 * tangent * before.change_v2);
  return std::min(limit, 0.25 * tangent * after.change_v2);
}

// Lowers entry speeds until each is reachable forwards and backwards; the run begins at the first
// move's own entry speed and ends at rest.
void LimitByReach(std::span<Node> run, double Node::*entry, double Node::*change) {
  double previous = 0;
  double reach = 0;
  for (std::size_t i = 0; i < run.size(); ++i) {
    run[i].*entry = i == 0 ? run[i].*entry : std::min(run[i].*entry, previous + reach);
    previous = run[i].*entry;
    reach = run[i].*change;
  }
  double next = 0;
  for (std::size_t i = run.size(); i-- > 0;) {
    run[i].*entry = std::min(run[i].*entry, next + run[i].*change);
    next = run[i].*entry;
  }
}

// Returns the top speeds under the smoothing acceleration: a move in which the smoothed motion both
// rises and falls is a peak; moves that rise to a peak or fall from it may not exceed the peak's
// own speed.
std::vector<double> PeaksV2(std::span<const Node> run) {
  std::vector<double> peak(run.size());
  std::vector<bool> apex(run.size());
  for (std::size_t i = 0; i < run.size(); ++i) {
    const double exit_v2 = i + 1 < run.size() ? run[i + 1].smooth_entry_v2 : 0;
    const double top = 0.5 * (run[i].smooth_entry_v2 + exit_v2 + run[i].smooth_change_v2);
    peak[i] = std::min(run[i].cruise_v2, top);
    apex[i] = top > std::max(run[i].smooth_entry_v2, exit_v2) * (1 + 1e-12);
  }
  // Finds the nearest peak ahead and behind in one pass each: a run can contain a million moves.
  std::vector<double> ahead(run.size(), kNoPeak);
  double nearest = kNoPeak;
  for (std::size_t i = run.size(); i-- > 0;) {
    nearest = apex[i] ? peak[i] : nearest;
    ahead[i] = nearest;
  }
  nearest = kNoPeak;
  for (std::size_t i = 0; i < run.size(); ++i) {
    nearest = apex[i] ? peak[i] : nearest;
    const double exit_v2 = i + 1 < run.size() ? run[i + 1].smooth_entry_v2 : 0;
    const bool rises = exit_v2 >= run[i].smooth_entry_v2;
    peak[i] = std::min(run[i].cruise_v2, rises ? ahead[i] : nearest);
  }
  return peak;
}

TimedMove Trapezoid(const Move& move, const Node& node, double exit_v2, double peak_v2) {
  const double entry_v2 = node.entry_v2;
  const double reachable_v2 = 0.5 * (entry_v2 + exit_v2 + node.change_v2);
  const double top_v2 =
      std::max({entry_v2, exit_v2, std::min({reachable_v2, peak_v2, node.cruise_v2})});
  TimedMove timed;
  timed.move = move;
  timed.length_mm = node.length_mm;
  timed.start_v_mm_s = std::sqrt(entry_v2);
  timed.cruise_v_mm_s = std::sqrt(top_v2);
  timed.end_v_mm_s = std::sqrt(exit_v2);
  const double a = move.acceleration_mm_s2;
  timed.accelerate_s = (timed.cruise_v_mm_s - timed.start_v_mm_s) / a;
  timed.decelerate_s = (timed.cruise_v_mm_s - timed.end_v_mm_s) / a;
  const double ramps_mm = (2 * top_v2 - entry_v2 - exit_v2) / (2 * a);
  timed.cruise_s = std::max(0.0, node.length_mm - ramps_mm) / timed.cruise_v_mm_s;
  return timed;
}

// Plans moves that begin with a speed and end at rest, and appends them.
void PlanRun(std::span<const Move> moves, double entry_v_mm_s, double& clock_s,
             std::vector<TimedMove>& plan) {
  std::vector<Node> run;
  run.reserve(moves.size());
  for (const Move& move : moves) run.push_back(MakeNode(move));
  if (!run.empty()) {
    run[0].entry_v2 = entry_v_mm_s * entry_v_mm_s;
    run[0].smooth_entry_v2 = run[0].entry_v2;
  }
  for (std::size_t i = 1; i < run.size(); ++i) {
    run[i].entry_v2 = JunctionV2(run[i - 1], run[i], moves[i - 1], moves[i]);
    run[i].smooth_entry_v2 = run[i].entry_v2;
  }
  LimitByReach(run, &Node::entry_v2, &Node::change_v2);
  LimitByReach(run, &Node::smooth_entry_v2, &Node::smooth_change_v2);
  const std::vector<double> peaks = PeaksV2(run);
  for (std::size_t i = 0; i < run.size(); ++i) {
    const double exit_v2 = i + 1 < run.size() ? run[i + 1].entry_v2 : 0;
    TimedMove timed = Trapezoid(moves[i], run[i], exit_v2, peaks[i]);
    timed.start_s = clock_s;
    clock_s = timed.end_s();
    plan.push_back(timed);
  }
}

}  // namespace

bool HasMotion(const Move& move) {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                    move.to.z_mm - move.from.z_mm) > 1e-9 ||
         std::abs(move.e_mm) > 1e-12;
}

std::vector<TimedMove> PlanContinuation(std::span<const Move> moves, double entry_v_mm_s) {
  std::vector<TimedMove> plan;
  plan.reserve(moves.size());
  double clock_s = 0;
  PlanRun(moves, entry_v_mm_s, clock_s, plan);
  return plan;
}

bool TimedMove::travels() const {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm) > 1e-9;
}

PathState StateAt(const TimedMove& move, double time_s) {
  const double a = move.move.acceleration_mm_s2;
  double t = std::clamp(time_s - move.start_s, 0.0, move.duration_s());
  if (t < move.accelerate_s) {
    return {(move.start_v_mm_s + 0.5 * a * t) * t, move.start_v_mm_s + a * t};
  }
  const double cruise_from_mm = 0.5 * (move.start_v_mm_s + move.cruise_v_mm_s) * move.accelerate_s;
  t -= move.accelerate_s;
  if (t < move.cruise_s) {
    return {cruise_from_mm + move.cruise_v_mm_s * t, move.cruise_v_mm_s};
  }
  const double left_s = std::max(0.0, move.decelerate_s - (t - move.cruise_s));
  const double left_mm = (move.end_v_mm_s + 0.5 * a * left_s) * left_s;
  return {std::max(0.0, move.length_mm - left_mm), move.end_v_mm_s + a * left_s};
}

std::vector<TimedMove> PlanMotion(std::span<const Move> moves) {
  std::vector<TimedMove> plan;
  plan.reserve(moves.size());
  std::vector<Move> run;
  double clock_s = 0;
  for (const Move& move : moves) {
    if (move.stop_before) {
      PlanRun(run, 0, clock_s, plan);
      run.clear();
      clock_s += std::min(move.dwell_before_s, kLongestDwellS);
    }
    if (HasMotion(move)) {
      run.push_back(move);
    }
  }
  PlanRun(run, 0, clock_s, plan);
  return plan;
}

}  // namespace trammel::sim
