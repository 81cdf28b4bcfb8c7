#include "pressure_advance/pattern/pattern_config.h"

#include <array>

#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::pressure_advance {
namespace {

using C = PatternConfig;

constexpr std::string_view kPrinter = "printer";
constexpr std::string_view kPattern = "pressure_advance_pattern";

constexpr auto kFields = std::to_array<PatternField>({
    {kPrinter, "idle_gcode", &C::idle_gcode, "", 0, 0,
     "Instead of end_gcode where finish = \"idle\": the bed stays warm and holds the pattern."},
    {kPrinter, "finish", &C::finish, "", 0, 0,
     "end, or idle: leave the bed warm because a scan follows."},
    {kPrinter, "restore_pressure_advance", &C::restore_pressure_advance_s, "s", 0, 10,
     "Pressure advance set at the end. Left out: the frame's stays."},
    {kPrinter, "restore_minimum_cruise_ratio", &C::restore_minimum_cruise_ratio, "", 0, 0.99,
     "Klipper's minimum_cruise_ratio set at the end."},
    {kPrinter, "extruder_drive", &C::extruder_drive, "", -1, 31,
     "RepRapFirmware: the drive D of M572. -1: the number of the tool that start_gcode selects, or "
     "0."},
    {kPrinter, "pressure_advance_limit", &C::pressure_advance_limit_s, "s", 0.001, 2,
     "More is applied only with --force. Direct drives need up to about 0.2, Bowden tubes up to 1, "
     "seldom 1.5. A pattern that goes further raises it to its own highest value."},

    {kPattern, "preset", &C::preset, "", 0, 0,
     "quick; paper, the published pattern and scan of three times the time; or photo, the pattern "
     "of "
     "--photo. Sets pressure_advances, line_length, segments, line_spacing, alternate_directions, "
     "lift_between_lines, frame_loops, frame_margin, frame_speed, approach_lift, corner_mark, and "
     "speed, skip, run_up, settle and lines_at_once of [scan], where they are left out."},
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
    {kPattern, "line_length", &C::line_length_mm, "mm", 1, 2000, "Length of a line."},
    {kPattern, "line_spacing", &C::line_spacing_mm, "mm", 0.1, 200,
     "From the middle of one line to the middle of the next."},
    {kPattern, "segments", &C::segments, "", 0, 0,
     "Stretches of a line in print order: fraction of its length (they add up to 1), speed in "
     "mm/s."},
    {kPattern, "acceleration", &C::acceleration_mm_s2, "mm/s²", 1, 1e6,
     "Acceleration of all moves of the pattern."},
    {kPattern, "layer_height", &C::layer_height_mm, "mm", 0.02, 2,
     "Height of the layer. Left out: at most 0.625 of nozzle_diameter."},
    {kPattern, "line_width", &C::line_width_mm, "mm", 0.05, 4,
     "Width of a bead; with the layer's height it says how much filament is extruded. Left out: "
     "1.24 "
     "times nozzle_diameter."},
    {kPattern, "alternate_directions", &C::alternate_directions, "", 0, 0,
     "Print every other line from its far end: shorter travels."},
    {kPattern, "frame_loops", &C::frame_loops, "", 0, 20,
     "Nested loops round the lines, by which the pattern lifts off in one piece."},
    {kPattern, "frame_overlap", &C::frame_overlap_mm, "mm", -50, 4,
     "How far the ends of the lines run into the frame's bead; negative: a gap."},
    {kPattern, "frame_margin", &C::frame_margin_mm, "mm", 0.05, 200,
     "From the outermost lines to the frame. Left out: line_spacing, or what a corner_mark needs."},
    {kPattern, "corner_mark", &C::corner_mark, "", 0, 0,
     "Fill the frame's corner beside the first line's start: a photo then shows which way it lies, "
     "mirrored or not."},
    {kPattern, "frame_speed", &C::frame_speed_mm_s, "mm/s", 0.1, 500, "Speed of the frame."},
    {kPattern, "frame_pressure_advance", &C::frame_pressure_advance_s, "s", 0, 10,
     "Pressure advance of the frame, and after the pattern."},
    {kPattern, "prime_length", &C::prime_length_mm, "mm", 0, 50,
     "Filament pushed out before each frame, so that it starts full."},
    {kPattern, "lift_between_lines", &C::lift_between_lines, "", 0, 0,
     "Lift by z_hop on the way from line to line, too. false needs alternate_directions: then the "
     "way runs from one line's end to the next one's beside it, across no bead."},
    {kPattern, "approach_lift", &C::approach_lift_mm, "mm", 0.5, 200,
     "Height above the layer from which the nozzle comes down on the pattern. Left out: "
     "park_lift."},
    {kPattern, "columns", &C::columns, "", 1, 100, "Patterns side by side."},
    {kPattern, "rows", &C::rows, "", 1, 100, "Patterns one behind the other."},
    {kPattern, "pattern_gap", &C::pattern_gap_mm, "mm", 0, 200, "Free plate between two patterns."},
});

}  // namespace

std::span<const PatternField> PatternFields() { return kFields; }

std::string_view ToString(Finish finish) { return finish == Finish::kIdle ? "idle" : "end"; }

std::optional<Finish> ParseFinish(std::string_view name) {
  for (Finish finish : {Finish::kEnd, Finish::kIdle}) {
    if (ToString(finish) == name) return finish;
  }
  return std::nullopt;
}

std::vector<gcode::Placeholder> PatternPlaceholders(const PatternConfig& config) {
  const BoundsMm printed = OuterBounds(config);
  return settings::Placeholders(
      config, config,
      {config.layer_height_mm, config.line_width_mm, config.acceleration_mm_s2, printed.min_x_mm,
       printed.min_y_mm, printed.max_x_mm, printed.max_y_mm});
}

namespace {

// Nowhere faster than the paper's pattern except where noted.
PatternConfig QuickPattern() {
  PatternConfig pattern;
  // Before the acceleration three lags of the slow flow, after the deceleration as many and a
  // reference stretch. The fast stretch is the paper's, and so are its speed and flow.
  pattern.line_length_mm = 25;
  pattern.segments = {{0.16, 10}, {0.6, 150}, {0.24, 10}};
  pattern.line_spacing_mm = 3;
  pattern.alternate_directions = true;
  pattern.lift_between_lines = false;
  pattern.frame_loops = 1;
  pattern.frame_margin_mm = 2;
  pattern.frame_speed_mm_s = 50;  // a third of the fast stretches' flow
  pattern.approach_lift_mm = 5;
  return pattern;
}

// All lines in one direction and close together, so that a photo of the whole is sharp enough, with
// a mark.
PatternConfig PhotoPattern() {
  constexpr int kLines = 21;
  PatternConfig pattern;
  pattern.pressure_advances_s.clear();
  for (int line = 0; line < kLines; ++line) pattern.pressure_advances_s.push_back(0.005 * line);
  pattern.segments = PhotoSegments();
  pattern.line_spacing_mm = 1.5;
  pattern.frame_margin_mm.reset();  // default: space for the mark
  pattern.frame_loops = std::max(pattern.frame_loops, 1);
  pattern.corner_mark = true;
  pattern.alternate_directions = false;
  return pattern;
}

settings::ScanSettings QuickScan() {
  settings::ScanSettings scan;
  scan.scan_speed_mm_s = 20;  // 0.67 mm a frame; travels run at 150 mm/s
  scan.skip_mm = 0.8;
  scan.run_up_mm = 0.5;
  scan.settle_s = 0.5;
  scan.lines_at_once = 5;
  return scan;
}

PatternConfig PatternOf(PatternPreset preset) {
  switch (preset) {
    case PatternPreset::kQuick:
      return QuickPattern();
    case PatternPreset::kPhoto:
      return PhotoPattern();
    case PatternPreset::kPaper:
      break;
  }
  return {};
}

settings::ScanSettings ScanOf(PatternPreset preset) {
  return preset == PatternPreset::kQuick ? QuickScan() : settings::ScanSettings{};
}

PatternPreset BeforeOf(const PatternConfig& pattern) {
  return ParsePatternPreset(pattern.preset).value_or(PatternPreset::kPaper);
}

}  // namespace

std::vector<Segment> PhotoSegments() { return {{0.1, 10}, {0.6, 100}, {0.3, 10}}; }

std::string_view ToString(PatternPreset preset) {
  switch (preset) {
    case PatternPreset::kQuick:
      return "quick";
    case PatternPreset::kPhoto:
      return "photo";
    case PatternPreset::kPaper:
      break;
  }
  return "paper";
}

std::optional<PatternPreset> ParsePatternPreset(std::string_view name) {
  for (const PatternPreset preset :
       {PatternPreset::kQuick, PatternPreset::kPaper, PatternPreset::kPhoto}) {
    if (ToString(preset) == name) return preset;
  }
  return std::nullopt;
}

void ApplyPreset(PatternPreset preset, PatternConfig& pattern) {
  const PatternConfig was = PatternOf(BeforeOf(pattern));
  const PatternConfig becomes = PatternOf(preset);
  const auto follow = [&](auto PatternConfig::*field) {
    if (pattern.*field == was.*field) pattern.*field = becomes.*field;
  };
  follow(&PatternConfig::pressure_advances_s);
  follow(&PatternConfig::corner_mark);
  follow(&PatternConfig::line_length_mm);
  follow(&PatternConfig::segments);
  follow(&PatternConfig::line_spacing_mm);
  follow(&PatternConfig::alternate_directions);
  follow(&PatternConfig::lift_between_lines);
  follow(&PatternConfig::frame_loops);
  follow(&PatternConfig::frame_margin_mm);
  follow(&PatternConfig::frame_speed_mm_s);
  follow(&PatternConfig::approach_lift_mm);
  pattern.preset = ToString(preset);
}

void ApplyPreset(PatternPreset preset, PatternConfig& pattern, settings::ScanSettings& scan) {
  using settings::ScanSettings;
  const ScanSettings was = ScanOf(BeforeOf(pattern));
  const ScanSettings becomes = ScanOf(preset);
  const auto follow = [&](auto ScanSettings::*field) {
    if (scan.*field == was.*field) scan.*field = becomes.*field;
  };
  follow(&ScanSettings::scan_speed_mm_s);
  follow(&ScanSettings::skip_mm);
  follow(&ScanSettings::run_up_mm);
  follow(&ScanSettings::settle_s);
  follow(&ScanSettings::lines_at_once);
  ApplyPreset(preset, pattern);
}

}  // namespace trammel::pressure_advance
