// Prints a sheet: from the nozzles' commanded moves to the ink on the flat paper.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"

namespace trammel::sim {

constexpr int kDirtInk = kMaxSheetTools;
constexpr int kInkCount = kMaxSheetTools + 1;

/// Point of a line's path and the line's edges beside it.
struct StrokePoint {
  PlaneMm centre;
  double left_mm = 0;   ///< to the left edge, in line direction
  double right_mm = 0;  ///< to the right edge; left + right > 0
};

/// Line of ink. Coordinates are the bed's, for flat paper.
struct InkStroke {
  int ink = 0;                      ///< tool, or kDirtInk
  double opacity = 1;               ///< 0 … 1
  bool raised = true;               ///< throws a shadow
  PlaneMm along;                    ///< unit vector from its start to its end
  std::vector<StrokePoint> points;  ///< at least 2; spacing up to 0.05 mm
};

/// True behaviour of a tool's lines on this sheet.
struct SheetToolTruth {
  int tool = 0;
  /// Position of its lines for a command, without backlash, noise and paper, minus that of a tool
  /// without any offset. Calibrations determine the difference of two of these.
  PlaneMm offset_mm;
  bool printed = true;  ///< true if any ink was printed
};

struct PrintedSheet {
  std::vector<InkStroke> strokes;
  std::array<LinearRgb, kInkCount> inks{};
  LinearRgb paper{};
  std::vector<SheetToolTruth> tools;  ///< those the file draws with, ascending
  std::array<double, 2> backlash_mm{};
  std::vector<std::string> notes;  ///< probable mistakes in the file, for users
};

/// Draws with a real hysteresis: each axis keeps where its play stands, along drawn lines and
/// travels alike. A line's width follows from its filament. What was retracted has to be primed
/// again before ink flows; above 1 mm nothing reaches the paper.
/// Each line's noise has a generator of its own: a change in one does not touch the others.
/// Error (kInput): a file that draws nothing.
[[nodiscard]] Result<PrintedSheet> PrintSheet(const SheetProgram& program,
                                              const SheetMachine& machine, const SheetPaper& paper,
                                              const Random& random);

/// Returns the landing offset of a tool minus that of the reference; absent if either drew nothing.
[[nodiscard]] std::optional<PlaneMm> OffsetOf(const PrintedSheet& sheet, int tool, int reference);

/// Line as drawn by the nozzle.
struct DrawnLine {
  int tool = 0;
  PlaneMm along;  ///< unit vector
  struct Point {
    PlaneMm nozzle;
    double width_mm = 0;
  };
  std::vector<Point> points;  ///< at least 2, in order
  bool joins_before = false;  ///< it goes on from an arc or into one: no bulge there
  bool joins_after = false;
};

/// Appends the line's ink; nothing if it does not stick, two strokes if it has a gap.
void AddStrokes(const DrawnLine& line, const SheetMachine& machine, const SheetPaper& paper,
                Random random, std::vector<InkStroke>& strokes);

/// Appends a thread of ooze from `from` towards `to`.
void AddString(int tool, const PlaneMm& from, const PlaneMm& to, const SheetPaper& paper,
               Random random, std::vector<InkStroke>& strokes);

/// Appends paper.dirt_count specks over and around the strokes, hairs across them, and the folds'
/// creases.
void AddDirt(const SheetPaper& paper, Random random, std::vector<InkStroke>& strokes);

}  // namespace trammel::sim
