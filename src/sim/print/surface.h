// Bed as a height field, for illumination.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "sim/print/bed.h"

namespace trammel::sim {

/// Axis-aligned part of the bed, mm.
struct BedRegion {
  double min_x_mm = 0;
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;

  [[nodiscard]] bool Contains(double x_mm, double y_mm) const {
    return x_mm >= min_x_mm && x_mm <= max_x_mm && y_mm >= min_y_mm && y_mm <= max_y_mm;
  }
};

/// Heights of printed material above the plate on a square grid; 0 is bare plate. Row-major, shape
/// (rows, columns); node (0, 0) is at the origin, rows towards +y.
struct Relief {
  double origin_x_mm = 0;
  double origin_y_mm = 0;
  double cell_mm = 0;
  int columns = 0;
  int rows = 0;
  std::vector<float> height_mm;
  std::vector<float> row_top_mm;  ///< largest height in each row

  [[nodiscard]] const float* row(int index) const {
    return height_mm.data() + static_cast<std::size_t>(index) * static_cast<std::size_t>(columns);
  }
  /// Interpolates bilinearly; 0 outside.
  [[nodiscard]] double HeightAt(double x_mm, double y_mm) const {
    const double x = (x_mm - origin_x_mm) / cell_mm;
    const double y = (y_mm - origin_y_mm) / cell_mm;
    if (!(x >= 0 && y >= 0 && x < columns - 1 && y < rows - 1)) return 0;
    const int column = static_cast<int>(x);
    const int below = static_cast<int>(y);
    const double fx = x - column;
    const double fy = y - below;
    const float* p = row(below) + column;
    const float* q = p + columns;
    return (1 - fy) * ((1 - fx) * static_cast<double>(p[0]) + fx * static_cast<double>(p[1])) +
           fy * ((1 - fx) * static_cast<double>(q[0]) + fx * static_cast<double>(q[1]));
  }
  /// True if the nearest node has material: the beads' true extent, without the slope that
  /// interpolation adds beyond their edges.
  [[nodiscard]] bool CoveredAt(double x_mm, double y_mm) const {
    const double x = std::floor((x_mm - origin_x_mm) / cell_mm + 0.5);
    const double y = std::floor((y_mm - origin_y_mm) / cell_mm + 0.5);
    return x >= 0 && y >= 0 && x < columns && y < rows &&
           row(static_cast<int>(y))[static_cast<int>(x)] > 0;
  }
  /// Returns an upper limit of the height anywhere at y_lo … y_hi; 0 outside.
  [[nodiscard]] double TopBetween(double y_lo_mm, double y_hi_mm) const;
};

/// Rasterises beads as ridges with round flanks and a flat-ish top: the cross-section z = h (1 - |2
/// d / w|^p)^(1/p), with p chosen so that its area is the sample's area_mm2 (p between 1 and 12;
/// beyond that width and height are preserved and area is lost). Strand ends are rounded. Where
/// beads overlap the higher one counts. Nodes are at whole multiples of cell_mm and have the mean
/// of their neighbourhood: the area of a bead is preserved within 0.2 %, whatever its width, at
/// cell_mm <= width / 12. REQUIRES 0.002 <= cell_mm <= 1 and a region of at most 40 million cells.
[[nodiscard]] Relief RasterizeBed(const Bed& bed, const BedRegion& region, double cell_mm);

/// True for prints of several layers.
[[nodiscard]] bool IsLayered(const Bed& bed);

/// Computes row_top_mm from height_mm; for reliefs built by hand.
void UpdateRowTops(Relief& relief);

}  // namespace trammel::sim
