#include "sim/sheet/sheet_print.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>

#include "sim/sheet/sheet_machine.h"

namespace trammel::sim {

namespace {

constexpr double kStepMm = 0.05;  // between two points of a line
constexpr double kReachMm = 1.0;  // above the bed; higher, filament does not stick
constexpr double kNoLengthMm = 1e-6;
constexpr double kTravelMm = 1;          // shorter ones draw no string
constexpr double kSameDirection = 1e-6;  // sine of the angle between two moves of one line
constexpr double kPrimedMm = 1e-7;       // filament; rounding of the file's five digits stays below
constexpr double kThinnestMm = 0.05;
constexpr double kWidestMm = 3;
constexpr std::size_t kMaxPoints = 20'000'000;

class Press {
 public:
  Press(const SheetMachine& machine, const SheetPaper& paper, const Random& random)
      : machine_(machine), paper_(paper), random_(random), nozzle_(machine, random.Fork(0)) {}

  void Run(const SheetMove& move);
  PrintedSheet Take();
  [[nodiscard]] std::size_t points() const { return points_; }

 private:
  // Returns the share of an extruding move after which ink flows; 1 if none does.
  double PrimedAt(const SheetMove& move);
  double WidthOf(const SheetMove& move, double length_mm) const;
  void Draw(const SheetMove& move, double from_fraction, double length_mm);
  void EndLine();
  void Travel(const SheetMove& move);
  void Note(const SheetMove& move);

  const SheetMachine& machine_;
  const SheetPaper& paper_;
  Random random_;
  SheetNozzle nozzle_;
  PrintedSheet sheet_;
  std::array<double, kMaxSheetTools> retracted_mm_{};
  std::array<std::optional<PlaneMm>, kMaxSheetTools> offsets_{};
  DrawnLine line_;
  bool arc_ = false;                 // the line that is being drawn is a chord of one
  std::optional<PlaneMm> line_end_;  // until the travel that leaves it
  std::uint64_t lines_ = 0;
  std::uint64_t travels_ = 0;
  std::size_t points_ = 0;
  int too_high_ = 0;
  int unprimed_ = 0;
  bool moved_offset_ = false;
};

double Press::PrimedAt(const SheetMove& move) {
  double& retracted_mm = retracted_mm_[static_cast<std::size_t>(move.tool)];
  const double missing_mm = retracted_mm;
  retracted_mm = std::max(0.0, retracted_mm - move.e_mm);
  if (missing_mm <= kPrimedMm) return 0;
  ++unprimed_;
  return std::min(1.0, missing_mm / move.e_mm);
}

double Press::WidthOf(const SheetMove& move, double length_mm) const {
  const double radius_mm = machine_.filament_diameter_mm / 2;
  const double area_mm2 = move.e_mm * std::numbers::pi * radius_mm * radius_mm / length_mm;
  const double height_mm = machine_.bead_height_mm;
  // A bead with round sides: area = (width - height) height + pi height^2 / 4.
  const double width_mm = area_mm2 / height_mm + height_mm * (1 - std::numbers::pi / 4);
  const double factor = machine_.tools[static_cast<std::size_t>(move.tool)].width_factor;
  return std::clamp(factor * width_mm, kThinnestMm, kWidestMm);
}

void Press::EndLine() {
  if (line_.points.size() >= 2) {
    AddStrokes(line_, machine_, paper_, random_.Fork(1000 + lines_++), sheet_.strokes);
    points_ += line_.points.size();
    line_end_ = line_.points.back().nozzle;
  }
  line_.points.clear();
}

void Press::Note(const SheetMove& move) {
  const auto tool = static_cast<std::size_t>(move.tool);
  const PlaneMm& own = machine_.tools[tool].offset_mm;
  const PlaneMm landing{own.x_mm + move.shift.x_mm, own.y_mm + move.shift.y_mm};
  if (!offsets_[tool]) offsets_[tool] = landing;
  moved_offset_ |= offsets_[tool]->x_mm != landing.x_mm || offsets_[tool]->y_mm != landing.y_mm;
}

void Press::Draw(const SheetMove& move, double from_fraction, double length_mm) {
  const PlaneMm along{(move.to.x_mm - move.from.x_mm) / length_mm,
                      (move.to.y_mm - move.from.y_mm) / length_mm};
  const double sine = along.x_mm * line_.along.y_mm - along.y_mm * line_.along.x_mm;
  const double cosine = along.x_mm * line_.along.x_mm + along.y_mm * line_.along.y_mm;
  const bool goes_on = !line_.points.empty() && line_.tool == move.tool && from_fraction == 0 &&
                       cosine > 0 && std::abs(sine) < kSameDirection;
  if (!goes_on) {
    const bool joins = !line_.points.empty() && line_.tool == move.tool && from_fraction == 0 &&
                       (move.arc || arc_);
    line_.joins_after = joins;
    EndLine();
    line_.joins_before = joins;
    line_.joins_after = false;
  }
  arc_ = move.arc;
  line_.tool = move.tool;
  line_.along = along;
  const double width_mm = WidthOf(move, length_mm);
  const double drawn_mm = length_mm * (1 - from_fraction);
  const int steps = std::max(1, static_cast<int>(std::ceil(drawn_mm / kStepMm)));
  for (int i = goes_on ? 1 : 0; i <= steps; ++i) {
    const double fraction = from_fraction + (1 - from_fraction) * i / steps;
    line_.points.push_back({nozzle_.At(move, fraction), width_mm});
  }
}

// The end of the last line may draw a string, whatever was retracted meanwhile.
void Press::Travel(const SheetMove& move) {
  if (!line_end_) return;
  const SheetTool& tool = machine_.tools[static_cast<std::size_t>(move.tool)];
  Random random = random_.Fork(1'000'000'000 + travels_++);
  if (tool.prints && random.Uniform() < tool.string_share) {
    AddString(move.tool, *line_end_, nozzle_.At(move, 1), paper_, random.Fork(0), sheet_.strokes);
  }
  line_end_.reset();
}

void Press::Run(const SheetMove& move) {
  const double length_mm = std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm);
  const auto tool = static_cast<std::size_t>(move.tool);
  const bool draws = move.e_mm > 0 && length_mm > kNoLengthMm;
  if (!draws) {
    retracted_mm_[tool] = std::max(0.0, retracted_mm_[tool] - move.e_mm);
    EndLine();
    if (length_mm > kTravelMm) Travel(move);
  } else if (move.z_mm > kReachMm) {
    ++too_high_;
    EndLine();
  } else if (const double from_fraction = PrimedAt(move); from_fraction < 1) {
    Note(move);
    Draw(move, from_fraction, length_mm);
  }
  nozzle_.Finish(move);
}

PrintedSheet Press::Take() {
  EndLine();
  AddDirt(paper_, random_.Fork(1), sheet_.strokes);
  sheet_.paper = paper_.reflectance;
  const bool light = paper_.reflectance[1] > 0.3;
  sheet_.inks[kDirtInk] = light ? LinearRgb{0.12, 0.10, 0.08} : LinearRgb{0.45, 0.45, 0.42};
  for (std::size_t tool = 0; tool < offsets_.size(); ++tool) {
    sheet_.inks[tool] = machine_.tools[tool].ink;
    if (!offsets_[tool]) continue;
    sheet_.tools.push_back({static_cast<int>(tool), *offsets_[tool], machine_.tools[tool].prints});
  }
  sheet_.backlash_mm = machine_.backlash_mm;
  const auto note = [this](int count, const char* what) {
    if (count > 0) sheet_.notes.push_back(fmt::format("{} lines {}", count, what));
  };
  note(too_high_, "extruded more than 1 mm above the bed were not drawn");
  note(unprimed_, "begin late because filament was still retracted");
  if (moved_offset_) {
    sheet_.notes.push_back(
        "the file moves a tool's offset between its lines; the truth is that "
        "of the first");
  }
  return std::move(sheet_);
}

}  // namespace

Result<PrintedSheet> PrintSheet(const SheetProgram& program, const SheetMachine& machine,
                                const SheetPaper& paper, const Random& random) {
  Press press(machine, paper, random);
  for (const SheetMove& move : program.moves) {
    press.Run(move);
    if (press.points() > kMaxPoints) {
      return Fail(fmt::format("G-code line {}: more than {} m of lines on one sheet", move.line,
                              static_cast<double>(kMaxPoints) * kStepMm / 1000));
    }
  }
  PrintedSheet sheet = press.Take();
  if (sheet.tools.empty()) return Fail("the file draws no line below 1 mm: there is no sheet");
  return sheet;
}

std::optional<PlaneMm> OffsetOf(const PrintedSheet& sheet, int tool, int reference) {
  std::optional<PlaneMm> own;
  std::optional<PlaneMm> other;
  for (const SheetToolTruth& truth : sheet.tools) {
    if (truth.tool == tool) own = truth.offset_mm;
    if (truth.tool == reference) other = truth.offset_mm;
  }
  if (!own || !other) return std::nullopt;
  return PlaneMm{own->x_mm - other->x_mm, own->y_mm - other->y_mm};
}

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

// Roughness of one edge: a first-order autoregression, exp(-distance / length).
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

// Share of a line's length that is missing.
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

namespace {

/// Bounding box of all that was drawn.
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

// Adds a hair with a randomly varying curvature; each short piece of it is a separate stroke.
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
