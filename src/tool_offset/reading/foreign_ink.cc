#include "tool_offset/reading/foreign_ink.h"

#include <algorithm>
#include <cmath>

#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::tool_offset {

std::vector<ForeignLeg> ForeignLegs(const SheetPlan& plan, const std::map<int, SheetPoint>& shift,
                                    double near_mm) {
  std::vector<ForeignLeg> foreign;
  for (const auto& [tool, by] : shift) {
    if (std::max(std::abs(by.u_mm), std::abs(by.v_mm)) <= near_mm) continue;
    for (const Leg& leg : LegsOfTool(plan, tool)) foreign.push_back({tool, Shifted(leg, by)});
  }
  return foreign;
}

int ForeignTool(std::span<const ForeignLeg> legs, SheetPoint low, SheetPoint high,
                double clear_mm) {
  for (const ForeignLeg& foreign : legs) {
    const auto [low_u, high_u] = std::minmax(foreign.leg.start.u_mm, foreign.leg.end.u_mm);
    const auto [low_v, high_v] = std::minmax(foreign.leg.start.v_mm, foreign.leg.end.v_mm);
    if (low_u - clear_mm < high.u_mm && high_u + clear_mm > low.u_mm &&
        low_v - clear_mm < high.v_mm && high_v + clear_mm > low.v_mm) {
      return foreign.tool;
    }
  }
  return -1;
}

std::vector<double> StrayInk(const InkRaster& raster, const SheetPlan& plan,
                             const std::map<int, SheetPoint>& shift, double ink_strength) {
  /// Beside a line: blur, shadow, and paper that lies elsewhere than the map says.
  constexpr double kBeside_mm = 0.35;
  constexpr double kInk = 0.35;  // of the reference tool's
  std::vector<std::uint8_t> known(raster.strength.size(), 0);
  const double half_mm = plan.settings.line_width_mm / 2 + kBeside_mm;
  for (const auto& [tool, by] : shift) {
    for (const Leg& leg : LegsOfTool(plan, tool)) {
      PaintLeg(raster, Shifted(leg, by), half_mm, known);
    }
  }
  const double threshold = std::max(raster.FaintestInk(), kInk * ink_strength);
  std::vector<double> stray;
  for (const Structure& structure : plan.structures) {
    const bool is_x = structure.axis == Axis::kX;
    const double length_mm = StructureLength_mm(plan.settings);
    const double thickness_mm = StructureThickness_mm(plan.settings);
    const double half_u_mm = (is_x ? length_mm : thickness_mm) / 2;
    const double half_v_mm = (is_x ? thickness_mm : length_mm) / 2;
    int white = 0;
    int ink = 0;
    const int last_row = std::min(raster.rows - 1, raster.Row(structure.middle.v_mm + half_v_mm));
    const int last_column =
        std::min(raster.columns - 1, raster.Column(structure.middle.u_mm + half_u_mm));
    for (int row = std::max(0, raster.Row(structure.middle.v_mm - half_v_mm)); row <= last_row;
         ++row) {
      for (int column = std::max(0, raster.Column(structure.middle.u_mm - half_u_mm));
           column <= last_column; ++column) {
        const std::size_t cell = raster.at(column, row);
        if (known[cell] != 0) continue;
        ++white;
        ink += raster.strength[cell] >= threshold ? 1 : 0;
      }
    }
    stray.push_back(white == 0 ? 0 : static_cast<double>(ink) / white);
  }
  return stray;
}

}  // namespace trammel::tool_offset
