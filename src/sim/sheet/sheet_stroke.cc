#include "sim/sheet/sheet_stroke.h"

#include <algorithm>
#include <cmath>

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
        (line.points[i].width_mm + wider_mm +
         (line.joins_before ? 0 : machine.start_bulge_mm * Bell(at_mm)) +
         (line.joins_after ? 0 : machine.end_bulge_mm * Bell(length_mm - at_mm))) /
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

}  // namespace trammel::sim
