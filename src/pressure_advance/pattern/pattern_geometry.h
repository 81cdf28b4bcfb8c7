// Where a pattern's parts lie relative to one another: shared by checking and laying out.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/profile/line_profile.h"

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

// Where the lines of a printed pattern lie: what a scan needs to know of it.

struct PlanLine {
  int pattern = 0;
  double pressure_advance_s = 0;
  double start_x_mm = 0;  ///< on the bed, where printing starts
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

/// The plan of one of its patterns alone, as if no other lay on the plate.
[[nodiscard]] PatternPlan PlanOfPattern(const PatternLayout& layout, const PatternConfig& config,
                                        int pattern, std::string gcode_file_name);

}  // namespace trammel::pressure_advance
