// Printed mark, a square of one bead, in one picture.
#pragma once

#include <array>
#include <string>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// The mark's shape on the plate.
struct MarkShape {
  double side_mm = 6;      ///< between the centre lines of opposite beads
  double bead_mm = 0.495;  ///< width of the bead
};

/// Position of the mark in a picture. Positions exist only without a fault.
struct MarkReading {
  std::string fault;   ///< why there is none, with figure and remedy
  bool blind = false;  ///< the picture itself is too dark or overexposed: no use to look elsewhere
  double column_px = 0;  ///< mark centre: mean of its corners
  double row_px = 0;
  double sigma_px = 0;  ///< 1 sigma in either direction, of what the beads' edges scatter
  double side_px = 0;   ///< mean of the sides between centre lines
  double turn_rad = 0;  ///< side from the picture's columns, clockwise as seen; -45 to 45 deg
  bool darker = false;  ///< than the plate
  double contrast = 0;  ///< grey levels between bead and plate
  std::array<vision::PointPx, 4> corners = {};  ///< centre line intersections, in order
};

/// Finds the square ring that differs most from its surroundings, darker or lighter. Fits the
/// centre line of each side to the middle of its bead in forty sections.
/// Faults: too dark, overexposed, no square, one that leaves the picture, a false one.
/// @param frame  8-bit BGR, without the laser; smaller than 32 x 32 px is a fault.
[[nodiscard]] MarkReading ReadMark(const BgrView& frame, const MarkShape& shape);

}  // namespace trammel::pressure_advance
