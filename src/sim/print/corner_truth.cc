#include "sim/print/corner_truth.h"

#include <array>
#include <cmath>
#include <cstddef>
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

}  // namespace

std::optional<double> CornerPressureAdvance(std::span<const TimedMove> plan,
                                            std::span<const Stroke> strokes,
                                            const StorageModel& law) {
  for (std::size_t k = strokes.size(); k-- > 0;) {
    const Stroke& stroke = strokes[k];
    if (stroke.last != stroke.first + 1 || !IsCorner(plan[stroke.first], plan[stroke.last])) {
      continue;
    }
    const std::array<Move, 2> arms = {plan[stroke.first].move, plan[stroke.last].move};
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
  return {};
}

}  // namespace trammel::sim
