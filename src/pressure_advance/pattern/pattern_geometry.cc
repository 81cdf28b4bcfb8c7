#include "pressure_advance/pattern/pattern_geometry.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "gcode/bead.h"
#include "gcode/dialect.h"

namespace trammel::pressure_advance {
namespace {

/// Returns PA as rounded in G-code, so that plan and file agree.
double AsWritten(double pressure_advance_s) {
  const double scale = std::pow(10, gcode::kPressureAdvanceDecimals);
  return std::round(pressure_advance_s * scale) / scale;
}

// Computes the pitch at which two rectangles of a bead's area and height touch.
double LoopPitch_mm(const PatternConfig& config) {
  return config.line_width_mm - config.layer_height_mm * gcode::kRoundSideLoss;
}

// Half of the room from the frame to the first line remains plate.
constexpr double kShareOfMargin = 0.45;

}  // namespace

std::vector<double> PressureAdvances(const PatternConfig& config) {
  std::vector<double> values;
  if (!config.pressure_advances_s.empty()) {
    for (double value : config.pressure_advances_s) values.push_back(AsWritten(value));
    return values;
  }
  for (int i = 0; i < config.line_count; ++i) {
    const double share = config.line_count > 1 ? double(i) / (config.line_count - 1) : 0;
    const double validated_s = share > 0.5 ? config.validated_pressure_advance_s.value_or(0) : 0;
    values.push_back(AsWritten(
        config.validated_pressure_advance_s
            ? validated_s
            : std::lerp(config.pressure_advance_start_s, config.pressure_advance_end_s, share)));
  }
  return values;
}

int PatternCount(const PatternConfig& config) {
  return config.patterns.value_or(config.columns * config.rows);
}

int DriveOf(const PatternConfig& config) {
  if (config.extruder_drive >= 0) return config.extruder_drive;
  return gcode::ToolSelectedBy(config.start_gcode).number.value_or(0);
}

double FastSpeed_mm_s(const PatternConfig& config) {
  return std::ranges::max_element(config.segments, {}, &Segment::speed_mm_s)->speed_mm_s;
}

PatternConfig SettingsOf(const PatternConfig& config, int pattern) {
  PatternConfig one = config;
  one.conditions.clear();
  const auto index = static_cast<std::size_t>(pattern);
  if (index >= config.conditions.size()) return one;
  const double fast_mm_s = FastSpeed_mm_s(config);
  for (Segment& segment : one.segments) {
    if (segment.speed_mm_s == fast_mm_s) {
      segment.speed_mm_s = config.conditions[index].fast_speed_mm_s;
    }
  }
  one.acceleration_mm_s2 = config.conditions[index].acceleration_mm_s2;
  return one;
}

double FilamentPerMm(const PatternConfig& config) {
  return gcode::FilamentPerMm(config.line_width_mm, config.layer_height_mm,
                              config.filament_diameter_mm);
}

double MarginForMark_mm(const PatternConfig& config) {
  return std::ceil(10 * kFewestMarkBeads * LoopPitch_mm(config) / kShareOfMargin) / 10;
}

PatternGeometry Geometry(const PatternConfig& config) {
  PatternGeometry geometry;
  const double half_bead_mm = config.line_width_mm / 2;
  const std::size_t lines = config.pressure_advances_s.empty()
                                ? static_cast<std::size_t>(std::max(config.line_count, 1))
                                : config.pressure_advances_s.size();
  geometry.inset_x_mm = half_bead_mm;
  geometry.inset_y_mm = half_bead_mm;
  if (config.frame_loops > 0) {
    geometry.loop_pitch_mm = LoopPitch_mm(config);
    geometry.end_to_loop_mm = config.line_width_mm - config.frame_overlap_mm;
    geometry.side_to_loop_mm = config.frame_margin_mm.value_or(
        config.corner_mark ? MarginForMark_mm(config) : config.line_spacing_mm);
    const double frame_mm = (config.frame_loops - 1) * geometry.loop_pitch_mm;
    if (config.corner_mark) {
      // Longer than the tenth of a line that the photo reader examines.
      constexpr double kShareOfLine = 0.12;
      geometry.mark_beads = static_cast<int>(std::clamp(
          kShareOfMargin * geometry.side_to_loop_mm / geometry.loop_pitch_mm, 0.0, 1000.0));
      geometry.mark_length_mm = geometry.end_to_loop_mm + kShareOfLine * config.line_length_mm;
    }
    geometry.inset_x_mm += frame_mm + geometry.end_to_loop_mm;
    geometry.inset_y_mm += frame_mm + geometry.side_to_loop_mm;
  }
  geometry.width_mm = config.line_length_mm + 2 * geometry.inset_x_mm;
  geometry.depth_mm =
      static_cast<double>(lines - 1) * config.line_spacing_mm + 2 * geometry.inset_y_mm;
  return geometry;
}

BoundsMm OuterBounds(const PatternConfig& config) {
  const PatternGeometry one = Geometry(config);
  const double width_mm =
      config.columns * (one.width_mm + config.pattern_gap_mm) - config.pattern_gap_mm;
  const double depth_mm =
      config.rows * (one.depth_mm + config.pattern_gap_mm) - config.pattern_gap_mm;
  BoundsMm bounds;
  bounds.min_x_mm =
      config.position_x_mm.value_or(config.bed_origin_x_mm + (config.bed_size_x_mm - width_mm) / 2);
  bounds.min_y_mm =
      config.position_y_mm.value_or(config.bed_origin_y_mm + (config.bed_size_y_mm - depth_mm) / 2);
  bounds.max_x_mm = bounds.min_x_mm + width_mm;
  bounds.max_y_mm = bounds.min_y_mm + depth_mm;
  return bounds;
}

BoundsMm PatternBounds(const PatternConfig& config, int index) {
  const PatternGeometry one = Geometry(config);
  const BoundsMm all = OuterBounds(config);
  const int column = index % config.columns;
  const int row = index / config.columns;
  BoundsMm bounds;
  bounds.min_x_mm = all.min_x_mm + column * (one.width_mm + config.pattern_gap_mm);
  bounds.min_y_mm = all.min_y_mm + row * (one.depth_mm + config.pattern_gap_mm);
  bounds.max_x_mm = bounds.min_x_mm + one.width_mm;
  bounds.max_y_mm = bounds.min_y_mm + one.depth_mm;
  return bounds;
}

PointMm ParkPoint(const PatternConfig& config) {
  const settings::ParkPosition park = settings::ParkPositionOf(config);
  return {park.x_mm, park.y_mm, PrintZ_mm(config) + config.park_lift_mm};
}

double ApproachZ_mm(const PatternConfig& config) {
  return PrintZ_mm(config) + config.approach_lift_mm.value_or(config.park_lift_mm);
}

double PrintZ_mm(const PatternConfig& config) {
  return config.layer_height_mm + config.z_offset_mm;
}

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
