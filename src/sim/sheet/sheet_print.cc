#include "sim/sheet/sheet_print.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "sim/sheet/sheet_dirt.h"
#include "sim/sheet/sheet_nozzle.h"
#include "sim/sheet/sheet_stroke.h"

namespace trammel::sim {
namespace {

constexpr double kStepMm = 0.05;  // between two points of a line
constexpr double kReachMm = 1.0;  // above the bed; higher, filament does not stick
constexpr double kNoLengthMm = 1e-6;
constexpr double kTravelMm = 1;          // shorter ones draw no string
constexpr double kSameDirection = 1e-6;  // of the sine between two moves of one line
constexpr double kPrimedMm = 1e-7;       // filament; rounding of the file's five digits stays below
constexpr double kThinnestMm = 0.05;
constexpr double kWidestMm = 3;
constexpr std::size_t kMostPoints = 20'000'000;

class Press {
 public:
  Press(const SheetMachine& machine, const SheetPaper& paper, const Random& random)
      : machine_(machine), paper_(paper), random_(random), nozzle_(machine, random.Fork(0)) {}

  void Run(const SheetMove& move);
  PrintedSheet Take();
  [[nodiscard]] std::size_t points() const { return points_; }

 private:
  // The share of an extruding move after which ink flows; 1 where none does.
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
  std::array<double, kMostSheetTools> retracted_mm_{};
  std::array<std::optional<PlaneMm>, kMostSheetTools> offsets_{};
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

// A string may hang from the end of the last line, whatever was retracted in between.
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
  TRY(Validate(machine));
  TRY(Validate(paper));
  Press press(machine, paper, random);
  for (const SheetMove& move : program.moves) {
    press.Run(move);
    if (press.points() > kMostPoints) {
      return Fail(fmt::format("G-code line {}: more than {} m of lines on one sheet", move.line,
                              static_cast<double>(kMostPoints) * kStepMm / 1000));
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

}  // namespace trammel::sim
