#pragma once

namespace trammel::part_alignment {

/// Ellipse in the picture. Pixel (0, 0) is the centre of the first pixel.
struct ImageEllipse {
  double column_px = 0;
  double row_px = 0;
  double semi_major_px = 0;
  double semi_minor_px = 0;
  double angle_rad = 0;  ///< major axis, from columns towards rows, in (-pi/2, pi/2]
};

}  // namespace trammel::part_alignment
