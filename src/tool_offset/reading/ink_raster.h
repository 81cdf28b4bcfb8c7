// The sheet as a raster of ink and paper, in its own coordinates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Side of a cell: a line of 0.4 mm is four cells wide.
inline constexpr double kInkCell_mm = 0.1;

/// How far each cell's colour is from the paper around it, and around the box as far as tools may
/// print.
struct InkRaster {
  double low_u_mm = 0;  ///< of the first cell's middle
  double low_v_mm = 0;
  int columns = 0;                     ///< along u
  int rows = 0;                        ///< along v
  std::vector<std::uint8_t> strength;  ///< 0 … 255 levels, row by row
  std::vector<std::uint8_t> on_page;   ///< 0 for cells beside the page, else 1
  double noise = 1;                    ///< of the paper, 1 sigma, in levels

  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  /// What ink differs from paper by at least, in levels.
  [[nodiscard]] double FaintestInk() const;
  [[nodiscard]] int Column(double u_mm) const;  ///< nearest; may lie beside the raster
  [[nodiscard]] int Row(double v_mm) const;
};

/// Samples the page.
/// @param around_mm  how far beside the box the raster reaches, >= 0.
/// Cost: one sample per cell and channel, on all processors.
[[nodiscard]] InkRaster TakeInkRaster(const PageView& page, const PageMap& map, double around_mm);

/// Median along the middles of legs, in levels; 0 where none lies in the raster. What differs from
/// the paper far around, also where no paper is left beside a leg.
[[nodiscard]] double MedianStrength(const InkRaster& raster, std::span<const Leg> legs);

/// Marks the cells within `half_mm` of a leg's middle line, and of its ends.
void PaintLeg(const InkRaster& raster, const Leg& leg, double half_mm,
              std::vector<std::uint8_t>& mask);

}  // namespace trammel::tool_offset
