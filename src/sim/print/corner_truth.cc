#include "sim/print/corner_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace trammel::sim {
namespace {

constexpr double kBeforeMm = 2.5;
constexpr double kBehindMm = 4;
constexpr double kShortestArmMm = 8;
constexpr double kSpacingMm = 0.02;

bool IsCorner(const TimedMove& a, const TimedMove& b) {
  if (a.length_mm < kShortestArmMm || std::abs(a.length_mm - b.length_mm) > 0.01) return false;
  const double cosine =
      ((a.move.to.x_mm - a.move.from.x_mm) * (b.move.to.x_mm - b.move.from.x_mm) +
       (a.move.to.y_mm - a.move.from.y_mm) * (b.move.to.y_mm - b.move.from.y_mm)) /
      (a.length_mm * b.length_mm);
  return std::abs(cosine) < 0.6 && a.move.feed_mm_s == b.move.feed_mm_s;
}

// Returns the surplus within the window, mm of filament.
double SurplusAt(std::array<Move, 2> arms, double advance_s, const StorageModel& law) {
  for (Move& move : arms) move.pressure_advance_s = advance_s;
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
  double laid_mm = 0;
  double commanded_mm = 0;
  for (std::size_t i = 0; i < deposit.filament_mm.size(); ++i) {
    const double from_corner_mm = static_cast<double>(i) * deposit.spacing_mm - corner_mm;
    if (from_corner_mm < -kBeforeMm || from_corner_mm > kBehindMm) continue;
    laid_mm += deposit.filament_mm[i];
    commanded_mm += deposit.spacing_mm * arms[0].e_mm / plan[0].length_mm;
  }
  return laid_mm - commanded_mm;
}

// Returns the advance without a surplus in the window; absent if the arms are starved without any.
std::optional<double> AdvanceOf(const std::array<Move, 2>& arms, const StorageModel& law) {
  // Small but not 0, where the averaging would be off.
  double low_s = 1e-6;
  double high_s = 10;
  if (SurplusAt(arms, low_s, law) <= 0) return {};
  for (int i = 0; i < 40; ++i) {
    const double middle_s = i < 20 ? std::sqrt(low_s * high_s) : (low_s + high_s) / 2;
    (SurplusAt(arms, middle_s, law) > 0 ? low_s : high_s) = middle_s;
  }
  return (low_s + high_s) / 2;
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
    const std::optional<double> corner_s = AdvanceOf(group.arms, law);
    if (!corner_s) continue;
    const Move& arm = group.arms[0];
    const double flow_mm_s = arm.feed_mm_s * arm.e_mm / group.length_mm;
    truths.push_back({arm.feed_mm_s, arm.acceleration_mm_s2,
                      IdealPressureAdvance(law, 0, flow_mm_s),
                      1 / FlowFromStored(law, Stored(law, flow_mm_s)).slope_per_s, *corner_s,
                      group.sum_x_mm / group.count, group.sum_y_mm / group.count});
  }
  return truths;
}

}  // namespace trammel::sim
