#include "pressure_advance/pattern_fields.h"

#include <array>

namespace trammel::pressure_advance {
namespace {

using C = PatternConfig;

constexpr std::string_view kPrinter = "printer";
constexpr std::string_view kFilament = "filament";
constexpr std::string_view kPattern = "pressure_advance_pattern";

constexpr auto kFields = std::to_array<PatternField>({
    {kPrinter, "dialect", &C::dialect, "", 0, 0, "Firmware: klipper, marlin or reprapfirmware."},
    {kPrinter, "bed_size_x", &C::bed_size_x_mm, "mm", 10, 2000, "Width of the bed."},
    {kPrinter, "bed_size_y", &C::bed_size_y_mm, "mm", 10, 2000, "Depth of the bed."},
    {kPrinter, "bed_origin_x", &C::bed_origin_x_mm, "mm", -2000, 2000,
     "X of the bed's left edge: -125 where a 250 mm bed has (0, 0) in its middle."},
    {kPrinter, "bed_origin_y", &C::bed_origin_y_mm, "mm", -2000, 2000,
     "Y of the bed's front edge."},
    {kPrinter, "bed_shape", &C::bed_shape, "", 0, 0,
     "rectangle, or ellipse: round beds as of deltas, inscribed in the bed's size."},
    {kPrinter, "bed_margin", &C::bed_margin_mm, "mm", 0, 100,
     "Kept free of filament along the bed's edge."},
    {kPrinter, "nozzle_diameter", &C::nozzle_diameter_mm, "mm", 0.1, 2, "Bore of the nozzle."},
    {kPrinter, "travel_speed", &C::travel_speed_mm_s, "mm/s", 1, 1000,
     "Speed of moves without filament."},
    {kPrinter, "z_speed", &C::z_speed_mm_s, "mm/s", 0.1, 100, "Speed of moves in z."},
    {kPrinter, "retract_length", &C::retract_length_mm, "mm", 0, 20,
     "Filament drawn back before a travel: about 0.5 with a direct drive, 2 to 6 with a Bowden "
     "tube."},
    {kPrinter, "retract_speed", &C::retract_speed_mm_s, "mm/s", 0.1, 200,
     "Speed of the filament when it is drawn back or pushed alone."},
    {kPrinter, "z_hop", &C::z_hop_mm, "mm", 0, 10, "How far the nozzle rises before a travel."},
    {kPrinter, "z_offset", &C::z_offset_mm, "mm", -0.5, 2,
     "Added to the height of the layer; at most half a layer downwards."},
    {kPrinter, "park_x", &C::park_x_mm, "mm", -2000, 2000,
     "Where the nozzle waits when done. Left out: bed_margin from the left edge, or the middle of "
     "a "
     "round bed."},
    {kPrinter, "park_y", &C::park_y_mm, "mm", -2000, 2000,
     "Where the nozzle waits when done. Left out: bed_margin from the front edge."},
    {kPrinter, "park_lift", &C::park_lift_mm, "mm", 1, 200,
     "Height above the layer before the first travel and when done; clears clips and the pattern."},
    {kPrinter, "start_gcode", &C::start_gcode, "", 0, 0,
     "Heats, homes, levels; may be just a macro call. {placeholders} stand for values."},
    {kPrinter, "end_gcode", &C::end_gcode, "", 0, 0,
     "Ends the print; has to switch the heaters off."},
    {kPrinter, "idle_gcode", &C::idle_gcode, "", 0, 0,
     "Instead of end_gcode where finish = \"idle\": the bed stays warm and holds the pattern."},
    {kPrinter, "finish", &C::finish, "", 0, 0,
     "end, or idle: leave the bed warm because a scan follows."},
    {kPrinter, "restore_pressure_advance", &C::restore_pressure_advance_s, "s", 0, 10,
     "Pressure advance set at the end. Left out: the frame's stays."},
    {kPrinter, "restore_acceleration", &C::restore_acceleration_mm_s2, "mm/s²", 1, 1e6,
     "Acceleration set at the end. Left out: the pattern's stays."},
    {kPrinter, "restore_minimum_cruise_ratio", &C::restore_minimum_cruise_ratio, "", 0, 0.99,
     "Klipper's minimum_cruise_ratio set at the end."},

    {kFilament, "filament_diameter", &C::filament_diameter_mm, "mm", 1, 4,
     "Diameter of the filament."},
    {kFilament, "density", &C::filament_density_g_cm3, "g/cm³", 0.5, 10,
     "Only for the weight that is shown. ABS 1.04, PLA 1.24, PETG 1.27."},
    {kFilament, "nozzle_temperature", &C::nozzle_temperature_c, "°C", 170, 500,
     "Temperature while printing."},
    {kFilament, "idle_nozzle_temperature", &C::idle_nozzle_temperature_c, "°C", 0, 500,
     "While the bed heats and while waiting for a scan: hot enough to be quick, too cold to ooze."},
    {kFilament, "bed_temperature", &C::bed_temperature_c, "°C", 0, 200, "Temperature of the bed."},

    {kPattern, "position_x", &C::position_x_mm, "mm", -2000, 2000,
     "Left outer edge of the first frame. Left out: centred on the bed."},
    {kPattern, "position_y", &C::position_y_mm, "mm", -2000, 2000,
     "Front outer edge of the first frame. Left out: centred on the bed."},
    {kPattern, "pressure_advance_start", &C::pressure_advance_start_s, "s", 0, 10,
     "Pressure advance of the first line."},
    {kPattern, "pressure_advance_end", &C::pressure_advance_end_s, "s", 0, 10,
     "Pressure advance of the last line; about 0.06 to 0.1 with a direct drive, 1 with a Bowden "
     "tube."},
    {kPattern, "line_count", &C::line_count, "", 2, 200, "Lines in one pattern."},
    {kPattern, "pressure_advances", &C::pressure_advances_s, "s", 0, 10,
     "The values one by one, instead of start, end and count."},
    {kPattern, "control_pressure_advance", &C::control_pressure_advance_s, "s", 0, 10,
     "Every line at this one value: a pattern that checks a calibrated printer."},
    {kPattern, "compare_pressure_advance", &C::compare_pressure_advance_s, "s", 0, 10,
     "Every line of the second and later patterns at this one value, beside a control."},
    {kPattern, "line_length", &C::line_length_mm, "mm", 1, 2000, "Length of a line."},
    {kPattern, "line_spacing", &C::line_spacing_mm, "mm", 0.1, 200,
     "From the middle of one line to the middle of the next."},
    {kPattern, "segments", &C::segments, "", 0, 0,
     "Stretches of a line in print order: fraction of its length (they add up to 1), speed in "
     "mm/s."},
    {kPattern, "acceleration", &C::acceleration_mm_s2, "mm/s²", 1, 1e6,
     "Acceleration of all moves of the pattern."},
    {kPattern, "layer_height", &C::layer_height_mm, "mm", 0.02, 2, "Height of the layer."},
    {kPattern, "line_width", &C::line_width_mm, "mm", 0.05, 4,
     "Width of a bead; with the layer's height it says how much filament is extruded."},
    {kPattern, "alternate_directions", &C::alternate_directions, "", 0, 0,
     "Print every other line from its far end: shorter travels."},
    {kPattern, "frame_loops", &C::frame_loops, "", 0, 20,
     "Nested loops round the lines, by which the pattern lifts off in one piece."},
    {kPattern, "frame_overlap", &C::frame_overlap_mm, "mm", -50, 4,
     "How far the ends of the lines run into the frame's bead; negative: a gap."},
    {kPattern, "frame_margin", &C::frame_margin_mm, "mm", 0.05, 200,
     "From the outermost lines to the frame. Left out: line_spacing."},
    {kPattern, "frame_speed", &C::frame_speed_mm_s, "mm/s", 0.1, 500, "Speed of the frame."},
    {kPattern, "frame_pressure_advance", &C::frame_pressure_advance_s, "s", 0, 10,
     "Pressure advance of the frame, and after the pattern."},
    {kPattern, "prime_length", &C::prime_length_mm, "mm", 0, 50,
     "Filament pushed out before each frame, so that it starts full."},
    {kPattern, "columns", &C::columns, "", 1, 100, "Patterns side by side."},
    {kPattern, "rows", &C::rows, "", 1, 100, "Patterns one behind the other."},
    {kPattern, "pattern_gap", &C::pattern_gap_mm, "mm", 0, 200, "Free plate between two patterns."},
});

}  // namespace

std::span<const PatternField> PatternFields() { return kFields; }

std::string_view ToString(BedShape shape) {
  return shape == BedShape::kEllipse ? "ellipse" : "rectangle";
}

std::string_view ToString(Finish finish) { return finish == Finish::kIdle ? "idle" : "end"; }

std::optional<BedShape> ParseBedShape(std::string_view name) {
  for (BedShape shape : {BedShape::kRectangle, BedShape::kEllipse}) {
    if (ToString(shape) == name) return shape;
  }
  return std::nullopt;
}

std::optional<Finish> ParseFinish(std::string_view name) {
  for (Finish finish : {Finish::kEnd, Finish::kIdle}) {
    if (ToString(finish) == name) return finish;
  }
  return std::nullopt;
}

}  // namespace trammel::pressure_advance
