#include "sim/print/corner_truth.h"

#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trammel::sim {
namespace {

constexpr double kShortestArmMm = 8;
constexpr double kAroundCornerMm = kShortestArmMm;
constexpr double kSpacingMm = 0.02;

bool IsCorner(const TimedMove& a, const TimedMove& b) {
  if (a.length_mm < kShortestArmMm || std::abs(a.length_mm - b.length_mm) > 0.01) return false;
  const double cosine =
      ((a.move.to.x_mm - a.move.from.x_mm) * (b.move.to.x_mm - b.move.from.x_mm) +
       (a.move.to.y_mm - a.move.from.y_mm) * (b.move.to.y_mm - b.move.from.y_mm)) /
      (a.length_mm * b.length_mm);
  return std::abs(cosine) < 0.6 && a.move.feed_mm_s == b.move.feed_mm_s;
}

// Returns the squared difference between what is laid around the corner and what was commanded
// there, summed along the path.
double DifferenceAt(std::array<Move, 2> arms, double advance_s, const StorageModel& law) {
  for (Move& move : arms) {
    move.pressure_advance_s = advance_s;
    move.smooth_time_s = 0;
  }
  arms[0].stop_before = true;
  arms[1].stop_before = false;
  const std::vector<TimedMove> plan = PlanMotion(arms);
  const std::vector<Stroke> strokes = FindStrokes(plan);
  StrokeFlow flow;
  flow.law = law;
  const Extrusion extrusion =
      Extrude(plan, strokes, DrivenFilament(plan), std::array{flow}, {}, kSpacingMm);
  const StrokeDeposit& deposit = extrusion.strokes[0];
  const double corner_mm = plan[0].length_mm;
  const double commanded_mm = deposit.spacing_mm * arms[0].e_mm / plan[0].length_mm;
  double sum = 0;
  for (std::size_t i = 0; i < deposit.filament_mm.size(); ++i) {
    const double from_corner_mm = static_cast<double>(i) * deposit.spacing_mm - corner_mm;
    if (std::abs(from_corner_mm) > kAroundCornerMm) continue;
    const double share = deposit.filament_mm[i] / commanded_mm - 1;
    sum += share * share;
  }
  return sum;
}

// Returns the advance with the least difference, between none and `most_s`.
double AdvanceOf(const std::array<Move, 2>& arms, const StorageModel& law, double most_s) {
  constexpr int kBits = 16;  // the advance to 2^-15 of itself
  const auto difference = [&](double advance_s) { return DifferenceAt(arms, advance_s, law); };
  return boost::math::tools::brent_find_minima(difference, 0.0, most_s, kBits).first;
}

// Corners of one speed and acceleration.
struct CornerGroup {
  std::array<Move, 2> arms;
  double length_mm = 0;
  double sum_x_mm = 0;
  double sum_y_mm = 0;
  int count = 0;
};

std::vector<CornerGroup> GroupCorners(std::span<const TimedMove> plan,
                                      std::span<const Stroke> strokes) {
  double top_mm = 0;
  for (const Stroke& stroke : strokes) top_mm = std::max(top_mm, plan[stroke.last].move.to.z_mm);
  std::vector<CornerGroup> groups;
  for (const Stroke& stroke : strokes) {
    const TimedMove& a = plan[stroke.first];
    const TimedMove& b = plan[stroke.last];
    if (stroke.last != stroke.first + 1 || a.move.to.z_mm < top_mm || !IsCorner(a, b)) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const CornerGroup& g) {
      return g.arms[0].feed_mm_s == a.move.feed_mm_s &&
             g.arms[0].acceleration_mm_s2 == a.move.acceleration_mm_s2;
    });
    if (group == groups.end()) group = groups.insert(groups.end(), {{}, a.length_mm, 0, 0, 0});
    group->arms = {a.move, b.move};
    group->sum_x_mm += a.move.to.x_mm;
    group->sum_y_mm += a.move.to.y_mm;
    ++group->count;
  }
  return groups;
}

}  // namespace

std::vector<CornerTruth> CornerTruths(std::span<const TimedMove> plan,
                                      std::span<const Stroke> strokes, const StorageModel& law) {
  std::vector<CornerTruth> truths;
  for (const CornerGroup& group : GroupCorners(plan, strokes)) {
    const Move& arm = group.arms[0];
    const double flow_mm_s = arm.feed_mm_s * arm.e_mm / group.length_mm;
    const double secant_s = IdealPressureAdvance(law, 0, flow_mm_s);
    truths.push_back({arm.feed_mm_s, arm.acceleration_mm_s2, secant_s,
                      1 / FlowFromStored(law, Stored(law, flow_mm_s)).slope_per_s,
                      AdvanceOf(group.arms, law, 2 * secant_s), group.sum_x_mm / group.count,
                      group.sum_y_mm / group.count});
  }
  return truths;
}

}  // namespace trammel::sim
