// How a line of ink looks: placed and as wide as chance has it, with rough edges, bulges and gaps.
#pragma once

#include <vector>

#include "base/random.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_paper.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// A line as the nozzle drew it.
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

/// Appends the line's ink; nothing where it does not stick, two strokes where it has a gap.
void AddStrokes(const DrawnLine& line, const SheetMachine& machine, const SheetPaper& paper,
                Random random, std::vector<InkStroke>& strokes);

/// Appends a thread of ooze that begins at `from` and lies towards `to`.
void AddString(int tool, const PlaneMm& from, const PlaneMm& to, const SheetPaper& paper,
               Random random, std::vector<InkStroke>& strokes);

}  // namespace trammel::sim
