#include "pressure_advance/pattern/pattern_plan.h"

#include <utility>
#include <vector>

namespace trammel::pressure_advance {

PatternPlan MakePlan(const PatternLayout& layout, const PatternConfig& config,
                     std::string gcode_file_name) {
  PatternPlan plan;
  plan.gcode = std::move(gcode_file_name);
  plan.bed_size_x_mm = config.bed_size_x_mm;
  plan.bed_size_y_mm = config.bed_size_y_mm;
  plan.bed_origin_x_mm = config.bed_origin_x_mm;
  plan.bed_origin_y_mm = config.bed_origin_y_mm;
  plan.layer_height_mm = config.layer_height_mm;
  plan.line_width_mm = config.line_width_mm;
  plan.line_length_mm = config.line_length_mm;
  plan.acceleration_mm_s2 = config.acceleration_mm_s2;
  plan.corner_mark = config.corner_mark;
  plan.printed_by.dialect = config.dialect;
  if (config.dialect == gcode::Dialect::kRepRapFirmware) plan.printed_by.drive = DriveOf(config);
  plan.segments = config.segments;
  for (const PatternLine& line : layout.lines) {
    plan.lines.push_back({line.pattern, line.pressure_advance_s, line.start.x_mm, line.start.y_mm,
                          line.end.x_mm, line.end.y_mm});
  }
  return plan;
}

PatternPlan PlanOfPattern(const PatternLayout& layout, const PatternConfig& config, int pattern,
                          std::string gcode_file_name) {
  PatternPlan plan = MakePlan(layout, SettingsOf(config, pattern), std::move(gcode_file_name));
  std::erase_if(plan.lines, [=](const PlanLine& line) { return line.pattern != pattern; });
  for (PlanLine& line : plan.lines) line.pattern = 0;
  return plan;
}

}  // namespace trammel::pressure_advance
