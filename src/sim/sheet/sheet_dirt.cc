#include "sim/sheet/sheet_dirt.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace trammel::sim {
namespace {

/// What encloses all that was drawn.
struct Extent {
  double lo_x = std::numeric_limits<double>::infinity();
  double lo_y = lo_x;
  double hi_x = -lo_x;
  double hi_y = -lo_x;
};

Extent ExtentOf(const std::vector<InkStroke>& strokes) {
  Extent extent;
  for (const InkStroke& stroke : strokes) {
    for (const StrokePoint& point : stroke.points) {
      extent.lo_x = std::min(extent.lo_x, point.centre.x_mm);
      extent.hi_x = std::max(extent.hi_x, point.centre.x_mm);
      extent.lo_y = std::min(extent.lo_y, point.centre.y_mm);
      extent.hi_y = std::max(extent.hi_y, point.centre.y_mm);
    }
  }
  return extent;
}

// A hair bends by a curvature that wanders; each short piece of it is a stroke of its own.
void AddHair(const Extent& extent, Random random, std::vector<InkStroke>& strokes) {
  constexpr double kPieceMm = 0.5;
  PlaneMm at{random.Uniform(extent.lo_x, extent.hi_x), random.Uniform(extent.lo_y, extent.hi_y)};
  double angle_rad = random.Uniform(0, 2 * std::numbers::pi);
  double bend_rad_mm = random.Normal(0, 0.03);
  const double half_mm = random.Uniform(0.02, 0.05);
  const double opacity = random.Uniform(0.4, 1);
  const double length_mm = random.Uniform(20, 80);
  for (double done_mm = 0; done_mm < length_mm; done_mm += kPieceMm) {
    const PlaneMm along{std::cos(angle_rad), std::sin(angle_rad)};
    const PlaneMm next{at.x_mm + kPieceMm * along.x_mm, at.y_mm + kPieceMm * along.y_mm};
    strokes.push_back(
        {kDirtInk, opacity, false, along, {{at, half_mm, half_mm}, {next, half_mm, half_mm}}});
    at = next;
    angle_rad += kPieceMm * bend_rad_mm;
    bend_rad_mm += random.Normal(0, 0.005);
  }
}

void AddCrease(const Extent& extent, const PaperFold& fold, std::vector<InkStroke>& strokes) {
  constexpr double kHalfMm = 0.06;
  constexpr double kPieceMm = 1;
  const PlaneMm along{std::cos(fold.direction_rad), std::sin(fold.direction_rad)};
  const auto inside = [&](const PlaneMm& place) {
    return place.x_mm >= extent.lo_x && place.x_mm <= extent.hi_x && place.y_mm >= extent.lo_y &&
           place.y_mm <= extent.hi_y;
  };
  InkStroke crease{kDirtInk, fold.darkness, false, along, {}};
  const double reach_mm = std::hypot(extent.hi_x - extent.lo_x, extent.hi_y - extent.lo_y);
  for (double at_mm = -reach_mm; at_mm <= reach_mm; at_mm += kPieceMm) {
    const PlaneMm place{fold.through.x_mm + at_mm * along.x_mm,
                        fold.through.y_mm + at_mm * along.y_mm};
    if (inside(place)) crease.points.push_back({place, kHalfMm, kHalfMm});
  }
  if (crease.points.size() >= 2) strokes.push_back(crease);
}

}  // namespace

void AddDirt(const SheetPaper& paper, Random random, std::vector<InkStroke>& strokes) {
  constexpr double kAroundMm = 8;
  const Extent extent = ExtentOf(strokes);
  for (int i = 0; i < paper.dirt_count; ++i) {
    const double x_mm = random.Uniform(extent.lo_x - kAroundMm, extent.hi_x + kAroundMm);
    const double y_mm = random.Uniform(extent.lo_y - kAroundMm, extent.hi_y + kAroundMm);
    const double angle_rad = random.Uniform(0, 2 * std::numbers::pi);
    const double half_mm = random.Uniform(0.01, 0.12);
    const double length_mm = random.Uniform(0.01, 0.3);
    const PlaneMm along{std::cos(angle_rad), std::sin(angle_rad)};
    InkStroke speck{kDirtInk, random.Uniform(0.2, 1), false, along, {}};
    speck.points.push_back({{x_mm, y_mm}, half_mm, half_mm});
    speck.points.push_back(
        {{x_mm + along.x_mm * length_mm, y_mm + along.y_mm * length_mm}, half_mm, half_mm});
    strokes.push_back(speck);
  }
  for (int i = 0; i < paper.hair_count; ++i) {
    AddHair(extent, random.Fork(static_cast<std::uint64_t>(i) + 1), strokes);
  }
  for (const PaperFold& fold : paper.folds) {
    if (fold.darkness > 0) AddCrease(extent, fold, strokes);
  }
}

}  // namespace trammel::sim
