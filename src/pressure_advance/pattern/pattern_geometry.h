// Where a pattern's parts lie relative to one another: shared by checking and laying out.
#pragma once

#include "pressure_advance/pattern/pattern.h"

namespace trammel::pressure_advance {

inline constexpr int kFewestMarkBeads = 3;  ///< of the corner mark: a blob is thinner

/// Distances within one pattern, between beads' centre lines unless said otherwise.
struct PatternGeometry {
  double loop_pitch_mm = 0;    ///< from one loop of the frame to the next, so that they fuse
  double end_to_loop_mm = 0;   ///< from a line's end to the innermost loop
  double side_to_loop_mm = 0;  ///< from the outermost line to the innermost loop
  double inset_x_mm = 0;       ///< from the pattern's outer edge to the lines' ends
  double inset_y_mm = 0;       ///< from the pattern's outer edge to the outermost line
  int mark_beads = 0;          ///< of the corner mark, beside the innermost loop; 0 without one
  double mark_length_mm = 0;   ///< along the lines, from the innermost loop
  double width_mm = 0;         ///< outer edge to outer edge
  double depth_mm = 0;
};

/// Pure arithmetic: finite for finite settings, also for ones that cannot be printed.
[[nodiscard]] PatternGeometry Geometry(const PatternConfig& config);

/// The frame_margin that leaves room for a corner mark of the fewest beads that a photo shows, up
/// to the next tenth of a millimetre.
[[nodiscard]] double MarginForMark_mm(const PatternConfig& config);

/// Outer edge of all patterns together, wherever it lies. Finite like Geometry().
[[nodiscard]] BoundsMm OuterBounds(const PatternConfig& config);

/// Outer edge of pattern `index`, row-major from the front left.
[[nodiscard]] BoundsMm PatternBounds(const PatternConfig& config, int index);

/// Where the nozzle goes when done.
[[nodiscard]] PointMm ParkPoint(const PatternConfig& config);

/// Height at which the nozzle comes over the bed before the print.
[[nodiscard]] double ApproachZ_mm(const PatternConfig& config);

/// Height of the nozzle while printing.
[[nodiscard]] double PrintZ_mm(const PatternConfig& config);

}  // namespace trammel::pressure_advance
