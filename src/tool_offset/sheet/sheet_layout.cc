#include "tool_offset/sheet/sheet_layout.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "base/check.h"
#include "tool_offset/sheet/paper_size.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_code.h"

namespace trammel::tool_offset {
namespace {

enum Kind : std::size_t { kX, kY, kCode, kKinds };

/// Some of the blocks, put together without gaps (each cell has its margin inside).
struct Packing {
  double width_mm = 0;
  double height_mm = 0;
  std::array<Grid, kKinds> grids;  ///< those that are not in it have cells of no size
};
using Packings = std::vector<Packing>;

/// Every way to stand `count` equal cells in a rectangle that wastes no whole column or row.
Packings Shapes(Kind kind, int count, double cell_width_mm, double cell_height_mm) {
  Packings shapes;
  for (int columns = 1; columns <= count; ++columns) {
    const int rows = (count + columns - 1) / columns;
    if ((columns - 1) * rows >= count) continue;
    Packing shape;
    shape.width_mm = columns * cell_width_mm;
    shape.height_mm = rows * cell_height_mm;
    shape.grids[kind] = {0, 0, cell_width_mm, cell_height_mm, columns, rows};
    shapes.push_back(shape);
  }
  return shapes;
}

Packing Join(const Packing& first, const Packing& second, bool side_by_side) {
  Packing joined = first;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    if (second.grids[kind].cell_width_mm == 0) continue;
    joined.grids[kind] = second.grids[kind];
    (side_by_side ? joined.grids[kind].left_mm : joined.grids[kind].bottom_mm) +=
        side_by_side ? first.width_mm : first.height_mm;
  }
  joined.width_mm =
      side_by_side ? first.width_mm + second.width_mm : std::max(first.width_mm, second.width_mm);
  joined.height_mm = side_by_side ? std::max(first.height_mm, second.height_mm)
                                  : first.height_mm + second.height_mm;
  return joined;
}

/// Drops what another packing beats in both sizes: whatever is asked of the outline grows with
/// them.
Packings Smallest(Packings packings) {
  std::stable_sort(packings.begin(), packings.end(), [](const Packing& a, const Packing& b) {
    return std::tie(a.width_mm, a.height_mm) < std::tie(b.width_mm, b.height_mm);
  });
  Packings kept;
  double lowest_mm = std::numeric_limits<double>::infinity();
  for (const Packing& packing : packings) {
    if (packing.height_mm >= lowest_mm) continue;
    lowest_mm = packing.height_mm;
    kept.push_back(packing);
  }
  return kept;
}

/// `below` and `above` one over the other.
Packings Stack(const Packings& below, const Packings& above) {
  Packings all;
  for (const Packing& lower : below) {
    for (const Packing& upper : above) all.push_back(Join(lower, upper, false));
  }
  return Smallest(std::move(all));
}

Packings StackOrStandBeside(const Packings& a, const Packings& b) {
  Packings all;
  for (const Packing& first : a) {
    for (const Packing& second : b) {
      all.push_back(Join(first, second, false));
      all.push_back(Join(first, second, true));
    }
  }
  return Smallest(std::move(all));
}

Packings AllPackings(const SheetSettings& settings, int x_structures, int y_structures) {
  const double gap_mm = settings.structure_gap_mm;
  const double length_mm = StructureLength_mm(settings) + gap_mm;
  const double thickness_mm = StructureThickness_mm(settings) + gap_mm;
  const Packings x = Shapes(kX, x_structures, length_mm, thickness_mm);
  const Packings y = Shapes(kY, y_structures, thickness_mm, length_mm);
  const Packings code = Shapes(kCode, 1, kCodeCells * kCodeCell_mm + gap_mm,
                               kCodeLeg_mm + settings.line_width_mm + gap_mm);
  return Stack(code, StackOrStandBeside(x, y));
}

/// 0 for the smallest paper that takes the turned outline, lying or standing.
int PaperClass(double width_mm, double height_mm) {
  int rank = 0;
  for (const PaperSize& paper : PaperSizes()) {
    if (paper.name == "letter") continue;  // as large as A4
    if (FitsPaper(paper, width_mm, height_mm)) break;
    ++rank;
  }
  return rank;
}

}  // namespace

double PrimeDepth_mm(const SheetSettings& settings) {
  return kPrimeGap_mm + settings.pick_ups * kPrimeRow_mm;
}

double StructureLength_mm(const SheetSettings& settings) {
  return (settings.teeth - 0.5) * settings.pitch_mm + settings.leg_spacing_mm +
         settings.line_width_mm;
}

double StructureThickness_mm(const SheetSettings& settings) {
  return 2 * settings.leg_length_mm - settings.overlap_mm + settings.line_width_mm;
}

SheetCost CostOfSheet(const SheetSettings& settings, double width_mm, double height_mm) {
  const std::optional<PaperSize> asked_for = FindPaper(settings.paper);
  const BedBounds bounds = SheetBounds(settings, width_mm, height_mm);
  const double x_mm = bounds.max_x_mm - bounds.min_x_mm;
  const double y_mm = bounds.max_y_mm - bounds.min_y_mm;
  const bool off_paper = asked_for && !FitsPaper(*asked_for, x_mm, y_mm);
  return {SheetReach(settings, width_mm, height_mm) > 1, off_paper, PaperClass(x_mm, y_mm),
          x_mm * y_mm};
}

Layout ArrangeSheet(const SheetSettings& settings, int x_structures, int y_structures,
                    double border_mm) {
  const Packings packings = AllPackings(settings, x_structures, y_structures);
  TRAMMEL_CHECK(!packings.empty(), "{} X and {} Y structures", x_structures, y_structures);
  const auto cost = [&](const Packing& packing) {
    return CostOfSheet(settings, packing.width_mm + 2 * border_mm,
                       packing.height_mm + 2 * border_mm);
  };
  const Packing& best =
      *std::min_element(packings.begin(), packings.end(),
                        [&](const Packing& a, const Packing& b) { return cost(a) < cost(b); });
  return {best.width_mm, best.height_mm, best.grids[kX], best.grids[kY], best.grids[kCode]};
}

}  // namespace trammel::tool_offset
