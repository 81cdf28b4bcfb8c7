#include "sim/sheet/sheet_stroke.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr double kBulgeLengthMm = 0.25;
constexpr double kThinnestHalfMm = 0.01;

double Distance(const PlaneMm& a, const PlaneMm& b) {
  return std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
}

double Bell(double distance_mm) {
  const double ratio = distance_mm / kBulgeLengthMm;
  return std::exp(-ratio * ratio);
}

// One edge's roughness: a first-order autoregression, exp(-distance / length).
class Edge {
 public:
  Edge(const SheetMachine& machine, Random& random)
      : sigma_mm_(machine.edge_roughness_mm),
        length_mm_(machine.edge_correlation_mm),
        random_(random),
        value_(random.Normal()) {}

  double Next(double step_mm) {
    const double kept = std::exp(-step_mm / length_mm_);
    value_ = kept * value_ + std::sqrt(1 - kept * kept) * random_.Normal();
    return sigma_mm_ * value_;
  }

 private:
  double sigma_mm_;
  double length_mm_;
  Random& random_;
  double value_;
};

// The share of a line's length at which it is missing.
struct Gap {
  double begin = 2;
  double end = 2;
};

Gap DrawGap(const SheetTool& tool, Random& random) {
  const double lot = random.Uniform();
  const double place = random.Uniform();
  const double size = random.Uniform(0.1, 0.7);
  if (!tool.prints) return {0, 1};
  if (lot >= tool.broken_share) return {};
  if (lot < 0.3 * tool.broken_share) return {0, 1};
  const double begin = place * (1 - size);
  return {begin, begin + size};
}

PlaneMm Flat(const SheetPaper& paper, const PlaneMm& place) {
  const PlaneMm moved = WrinkleAt(paper, place);
  return {place.x_mm + moved.x_mm, place.y_mm + moved.y_mm};
}

void Keep(InkStroke& stroke, std::vector<InkStroke>& strokes) {
  if (stroke.points.size() >= 2) strokes.push_back(stroke);
  stroke.points.clear();
}

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
  Keep(crease, strokes);
}

}  // namespace

void AddStrokes(const DrawnLine& line, const SheetMachine& machine, const SheetPaper& paper,
                Random random, std::vector<InkStroke>& strokes) {
  const SheetTool& tool = machine.tools[static_cast<std::size_t>(line.tool)];
  const double x_mm = random.Normal(0, machine.leg_placement_mm);
  const double y_mm = random.Normal(0, machine.leg_placement_mm);
  const double wider_mm = random.Normal(0, machine.leg_width_mm);
  const Gap gap = DrawGap(tool, random);
  Random sticking = random.Fork(3);
  if (tool.missing_share > 0 && sticking.Uniform() < tool.missing_share) return;
  Random left_random = random.Fork(1);
  Random right_random = random.Fork(2);
  Edge left(machine, left_random);
  Edge right(machine, right_random);
  double length_mm = 0;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    length_mm += Distance(line.points[i - 1].nozzle, line.points[i].nozzle);
  }
  InkStroke stroke{line.tool, tool.opacity, true, line.along, {}};
  double at_mm = 0;
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    const PlaneMm& nozzle = line.points[i].nozzle;
    const double step_mm = i == 0 ? 0 : Distance(line.points[i - 1].nozzle, nozzle);
    at_mm += step_mm;
    const double half_mm =
        (line.points[i].width_mm + wider_mm + machine.start_bulge_mm * Bell(at_mm) +
         machine.end_bulge_mm * Bell(length_mm - at_mm)) /
        2;
    const double left_mm = std::max(kThinnestHalfMm, half_mm + left.Next(step_mm));
    const double right_mm = std::max(kThinnestHalfMm, half_mm + right.Next(step_mm));
    if (at_mm >= gap.begin * length_mm && at_mm <= gap.end * length_mm) {
      Keep(stroke, strokes);
      continue;
    }
    const PlaneMm placed{nozzle.x_mm + x_mm, nozzle.y_mm + y_mm};
    stroke.points.push_back({Flat(paper, placed), left_mm, right_mm});
  }
  Keep(stroke, strokes);
}

void AddString(int tool, const PlaneMm& from, const PlaneMm& to, const SheetPaper& paper,
               Random random, std::vector<InkStroke>& strokes) {
  const double way_mm = Distance(from, to);
  const double length_mm = std::min(way_mm, random.Uniform(0.5, 3));
  if (length_mm < 0.05) return;
  const PlaneMm along{(to.x_mm - from.x_mm) / way_mm, (to.y_mm - from.y_mm) / way_mm};
  const double half_mm = random.Uniform(0.02, 0.06);
  InkStroke stroke{tool, random.Uniform(0.3, 0.8), false, along, {}};
  const int steps = static_cast<int>(std::ceil(length_mm / 0.2));
  for (int i = 0; i <= steps; ++i) {
    const double at_mm = length_mm * i / steps;
    const double thin_mm = half_mm * (1 - 0.7 * i / steps);
    const PlaneMm place{from.x_mm + along.x_mm * at_mm, from.y_mm + along.y_mm * at_mm};
    stroke.points.push_back({Flat(paper, place), thin_mm, thin_mm});
  }
  strokes.push_back(stroke);
}

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
