// Relative positions of a pattern's parts: shared by checking and layout.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

inline constexpr int kFewestMarkBeads = 3;  ///< in the corner mark: a blob is thinner

/// Distances within one pattern, between beads' centre lines unless stated otherwise.
struct PatternGeometry {
  double loop_pitch_mm = 0;    ///< spacing of the frame's loops, so that they fuse
  double end_to_loop_mm = 0;   ///< line end to innermost loop
  double side_to_loop_mm = 0;  ///< outermost line to innermost loop
  double inset_x_mm = 0;       ///< pattern's outer edge to line ends
  double inset_y_mm = 0;       ///< pattern's outer edge to outermost line
  int mark_beads = 0;          ///< corner mark's beads, beside the innermost loop; 0: no mark
  double mark_length_mm = 0;   ///< along the lines, from the innermost loop
  double width_mm = 0;         ///< outer edge to outer edge
  double depth_mm = 0;
};

/// Computes the geometry: finite for finite settings, even for unprintable ones.
[[nodiscard]] PatternGeometry Geometry(const PatternConfig& config);

/// Returns the frame_margin for the smallest corner mark visible in a photo, rounded up to a tenth
/// of a millimetre.
[[nodiscard]] double MarginForMark_mm(const PatternConfig& config);

/// Returns the outer edge of all patterns together, wherever it is. Finite like Geometry().
[[nodiscard]] BoundsMm OuterBounds(const PatternConfig& config);

/// Returns the outer edge of pattern `index`, row-major from the front left.
[[nodiscard]] BoundsMm PatternBounds(const PatternConfig& config, int index);

/// Position of the nozzle after the print.
[[nodiscard]] PointMm ParkPoint(const PatternConfig& config);

/// Returns the nozzle's height when it approaches the bed before the print.
[[nodiscard]] double ApproachZ_mm(const PatternConfig& config);

/// Returns the nozzle's height while printing.
[[nodiscard]] double PrintZ_mm(const PatternConfig& config);

// Positions of a printed pattern's lines, for a scan.

struct PlanLine {
  int pattern = 0;
  double pressure_advance_s = 0;
  double start_x_mm = 0;  ///< start of printing, on the bed
  double start_y_mm = 0;
  double end_x_mm = 0;
  double end_y_mm = 0;
};

/// Format 1 of *.plan.json; docs/reference/formats.md has every key with its bounds.
struct PatternPlan {
  std::string gcode;  ///< file name, beside the plan
  double bed_size_x_mm = 0;
  double bed_size_y_mm = 0;
  double bed_origin_x_mm = 0;  ///< coordinates of the bed's front left corner
  double bed_origin_y_mm = 0;
  double layer_height_mm = 0;
  double line_width_mm = 0;
  double line_length_mm = 0;
  double acceleration_mm_s2 = 0;
  bool corner_mark = false;  ///< PatternConfig::corner_mark
  gcode::PrintedBy printed_by;
  std::vector<Segment> segments;
  std::vector<PlanLine> lines;  ///< in print order
};

/// REQUIRES a layout from LayOut(config).
[[nodiscard]] PatternPlan MakePlan(const PatternLayout& layout, const PatternConfig& config,
                                   std::string gcode_file_name);

/// Returns the plan of one of its patterns, as if it were alone on the plate.
[[nodiscard]] PatternPlan PlanOfPattern(const PatternLayout& layout, const PatternConfig& config,
                                        int pattern, std::string gcode_file_name);

}  // namespace trammel::pressure_advance
