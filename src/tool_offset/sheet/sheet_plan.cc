#include "tool_offset/sheet/sheet_plan.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "tool_offset/sheet/paper_size.h"
#include "tool_offset/sheet/photo_layout.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_code.h"
#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_structures.h"

namespace trammel::tool_offset {
namespace {

/// CRC-16 (polynomial 0x1021, start 0xffff) of whole numbers.
class CheckSum {
 public:
  void Add(long long number) {
    for (int byte = 0; byte < 8; ++byte) {
      sum_ ^= static_cast<std::uint32_t>(number >> (8 * byte) & 0xff) << 8;
      for (int bit = 0; bit < 8; ++bit) {
        sum_ = (sum_ << 1) ^ ((sum_ & 0x8000u) != 0 ? 0x11021u : 0u);
      }
    }
  }
  /// In µm: coarser than any rounding, finer than any reading.
  void AddLength(double length_mm) { Add(std::llround(length_mm * 1000)); }
  void Add(const Leg& leg) {
    for (const SheetPoint& point : {leg.start, leg.end}) {
      AddLength(point.u_mm);
      AddLength(point.v_mm);
    }
  }
  [[nodiscard]] std::uint16_t value() const { return static_cast<std::uint16_t>(sum_); }

 private:
  std::uint32_t sum_ = 0xffff;
};

std::uint16_t SheetId(const SheetPlan& plan) {
  constexpr int kArrangement = 2;  // another one draws other sheets of the same settings
  CheckSum sum;
  sum.Add(kArrangement);
  sum.Add(plan.settings.reference_tool);
  sum.AddLength(plan.settings.tilt_deg);
  sum.AddLength(plan.width_mm);
  sum.AddLength(plan.height_mm);
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      sum.Add(structure.combs[comb].tool);
      sum.Add(structure.combs[comb].pick_up);
      for (const int finger : {0, plan.settings.teeth - 1}) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) sum.Add(leg);
      }
    }
  }
  return sum.value();
}

/// To a micron: so that no sum of sizes stands on the edge between two values of the check sum.
SheetPoint Rounded(const SheetPoint& point) {
  return {std::round(point.u_mm * 1000) / 1000, std::round(point.v_mm * 1000) / 1000};
}

/// Cells along the longer side of the grid's lines first: neighbours in the list stay neighbours.
SheetPoint CellOf(const Grid& grid, int index, bool by_columns) {
  const int column = by_columns ? index / grid.rows : index % grid.columns;
  const int row = by_columns ? index % grid.rows : index / grid.columns;
  TRAMMEL_CHECK(column < grid.columns && row < grid.rows, "cell {} of {} x {}", index, grid.columns,
                grid.rows);
  return grid.CellMiddle(column, row);
}

}  // namespace

/// Each tool has its own stretch below the box, each pick-up its own row.
std::vector<PrimeLine> PrimeLines(const SheetPlan& plan) {
  const SheetSettings& settings = plan.settings;
  const double stretch_mm = plan.width_mm / static_cast<double>(settings.tools.size());
  const double length_mm = std::min(kPrimeLength_mm, 0.8 * stretch_mm);
  std::vector<PrimeLine> lines;
  for (int pick_up = 0; pick_up <= settings.pick_ups; ++pick_up) {
    const double v_mm = -plan.height_mm / 2 - kPrimeGap_mm - pick_up * kPrimeRow_mm;
    for (std::size_t i = 0; i < settings.tools.size(); ++i) {
      const double u_mm =
          -plan.width_mm / 2 + static_cast<double>(i) * stretch_mm + (stretch_mm - length_mm) / 2;
      lines.push_back({settings.tools[i], pick_up, {{u_mm, v_mm}, {u_mm + length_mm, v_mm}}});
    }
  }
  return lines;
}

namespace {

/// From the layout's lower left corner to the sheet's middle.
SheetPoint OnSheet(SheetPoint in_layout, double width_mm, double height_mm) {
  return {in_layout.u_mm - width_mm / 2, in_layout.v_mm - height_mm / 2};
}

/// Sets the box's size and all structures into it.
/// @returns the middle of the code.
SheetPoint Place(const std::vector<Structure>& x, const std::vector<Structure>& y, double border_mm,
                 SheetPlan& plan) {
  const Layout layout = ArrangeSheet(plan.settings, static_cast<int>(x.size()),
                                     static_cast<int>(y.size()), border_mm);
  plan.width_mm = Rounded({layout.width_mm + 2 * border_mm, 0}).u_mm;
  plan.height_mm = Rounded({layout.height_mm + 2 * border_mm, 0}).u_mm;
  for (std::size_t i = 0; i < x.size() + y.size(); ++i) {
    const bool is_x = i < x.size();
    const std::size_t in_grid = is_x ? i : i - x.size();
    plan.structures.push_back(is_x ? x[in_grid] : y[in_grid]);
    const Grid& grid = is_x ? layout.x_structures : layout.y_structures;
    plan.structures.back().middle = Rounded(
        OnSheet(CellOf(grid, static_cast<int>(in_grid), is_x), layout.width_mm, layout.height_mm));
  }
  return OnSheet(layout.code.CellMiddle(0, 0), layout.width_mm, layout.height_mm);
}

/// The same, arranged for a camera.
SheetPoint PlaceForPhoto(const std::vector<Structure>& x, const std::vector<Structure>& y,
                         double border_mm, SheetPlan& plan) {
  const PhotoLayout layout = ArrangeForPhoto(plan.settings, x, y, border_mm);
  plan.width_mm = Rounded({layout.width_mm + 2 * border_mm, 0}).u_mm;
  plan.height_mm = Rounded({layout.height_mm + 2 * border_mm, 0}).u_mm;
  const auto add = [&](const std::vector<Structure>& structures,
                       const std::vector<SheetPoint>& middles) {
    for (std::size_t i = 0; i < structures.size(); ++i) {
      plan.structures.push_back(structures[i]);
      plan.structures.back().middle =
          Rounded(OnSheet(middles[i], layout.width_mm, layout.height_mm));
    }
  };
  add(x, layout.x_structures);
  add(y, layout.y_structures);
  return OnSheet(layout.code, layout.width_mm, layout.height_mm);
}

/// The sheet with just so many teeth, whatever it is printed on.
SheetPlan PlanWithTeeth(const SheetSettings& settings) {
  SheetPlan plan;
  plan.settings = settings;
  for (int line = 0; line < kBoxLines; ++line) {
    plan.box_insets_mm.push_back(line * settings.leg_spacing_mm);
  }
  const std::vector<Structure> x = ListStructures(settings, Axis::kX);
  const std::vector<Structure> y = ListStructures(settings, Axis::kY);
  // Cells have half of the gap inside.
  const double border_mm = plan.box_insets_mm.back() + settings.structure_gap_mm / 2;
  const SheetPoint code_middle =
      settings.for_photo ? PlaceForPhoto(x, y, border_mm, plan) : Place(x, y, border_mm, plan);
  plan.sheet_id = SheetId(plan);
  const CodeCells cells = EncodeSheetId(plan.sheet_id);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double along = static_cast<double>(i) - (static_cast<double>(cells.size()) - 1) / 2;
    plan.code.push_back(
        {Rounded({code_middle.u_mm + along * kCodeCell_mm, code_middle.v_mm}), cells[i]});
  }
  plan.prime_lines = PrimeLines(plan);
  return plan;
}

}  // namespace

bool FitsItsPaper(const SheetPlan& plan) {
  const auto paper = FindPaper(plan.settings.paper);
  if (!paper) return true;
  const BedBounds bounds = SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  return FitsPaper(*paper, bounds.max_x_mm - bounds.min_x_mm, bounds.max_y_mm - bounds.min_y_mm);
}

SheetPlan PlanSheet(const SheetSettings& settings) {
  SheetPlan plan = PlanWithTeeth(settings);
  for (SheetSettings fewer = settings; fewer.teeth > kFewestTeethToFit;) {
    if (FitsItsPaper(plan)) return plan;
    --fewer.teeth;
    plan = PlanWithTeeth(fewer);
  }
  return plan;
}

}  // namespace trammel::tool_offset
