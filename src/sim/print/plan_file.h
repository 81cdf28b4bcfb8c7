// Reads *.plan.json: the positions of a printed pattern's lines.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

struct PlannedSegment {
  double fraction = 0;
  double speed_mm_s = 0;
};

struct PlannedLine {
  int pattern = 0;
  double pressure_advance_s = 0;
  double start_x_mm = 0;
  double start_y_mm = 0;
  double end_x_mm = 0;
  double end_y_mm = 0;
};

/// Format 1 of *.plan.json (docs/reference/formats.md), limited to the fields that trammel-sim
/// needs.
struct Plan {
  double line_length_mm = 0;
  double acceleration_mm_s2 = 0;
  double layer_height_mm = 0;
  double line_width_mm = 0;
  std::vector<PlannedSegment> segments;
  std::vector<PlannedLine> lines;
};

/// Errors (kInput) name the file, the key, the value and the bound: text that is not JSON, missing
/// keys, wrong types, numbers out of bounds.
[[nodiscard]] Result<Plan> ParsePlan(std::string_view json, const std::string& file = "the plan");

}  // namespace trammel::sim
