// Where the lines of a printed pattern lie: what a scan needs to know of it.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/profile/line_motion.h"

namespace trammel::pressure_advance {

struct PlanLine {
  int pattern = 0;
  double pressure_advance_s = 0;
  double start_x_mm = 0;  ///< on the bed, where printing starts
  double start_y_mm = 0;
  double end_x_mm = 0;
  double end_y_mm = 0;
};

/// Format 1 of *.plan.json; docs/formats.md has every key with its bounds.
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
