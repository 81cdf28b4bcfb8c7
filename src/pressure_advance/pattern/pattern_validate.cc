#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "gcode/dialect.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

using Problem = std::optional<settings::SettingProblem>;

constexpr std::size_t kMaxLinesInAll = 10000;  // hours of printing, megabytes of G-code

Problem InSection(const char* section, const char* key, std::string message) {
  return settings::SettingProblem{section, key, std::move(message)};
}

Problem InPattern(const char* key, std::string message) {
  return InSection("pressure_advance_pattern", key, std::move(message));
}

Problem CheckFields(const PatternConfig& config) {
  if (Problem problem = settings::FindFieldProblems(config, settings::PrinterFields())) {
    return problem;
  }
  if (Problem problem = settings::FindFieldProblems(config, settings::FilamentFields())) {
    return problem;
  }
  if (Problem problem = settings::FindMaterialProblem(config)) return problem;
  return settings::FindFieldProblems(config, PatternFields());
}

// Checks the values of the whole file against the firmware's command.
Problem CheckFirmwareRange(const PatternConfig& config) {
  const gcode::FirmwareWords& words = gcode::WordsOf(config.dialect);
  const auto check = [&](const char* section, const char* key, double value_s) -> Problem {
    if (!(value_s > words.max_advance_s)) return std::nullopt;
    return InSection(
        section, key,
        fmt::format("{} s is above {} s, the most that {} accepts", value_s,
                    gcode::FormatNumber(words.max_advance_s, gcode::kPressureAdvanceDecimals),
                    words.title));
  };
  constexpr const char* kPattern = "pressure_advance_pattern";
  for (const double value_s : config.pressure_advances_s) {
    if (Problem problem = check(kPattern, "pressure_advances", value_s)) return problem;
  }
  for (const auto& [section, key, value_s] :
       {std::tuple{kPattern, "pressure_advance_end",
                   config.pressure_advances_s.empty() ? config.pressure_advance_end_s : 0.0},
        {kPattern, "frame_pressure_advance", config.frame_pressure_advance_s},
        {"printer", "restore_pressure_advance", config.restore_pressure_advance_s.value_or(0)}}) {
    if (Problem problem = check(section, key, value_s)) return problem;
  }
  return std::nullopt;
}

Problem CheckPressureAdvances(const PatternConfig& config) {
  constexpr std::size_t kMaxLines = 200;
  if (config.validated_pressure_advance_s) return std::nullopt;
  if (const auto& list = config.pressure_advances_s; !list.empty()) {
    if (list.size() < 2 || list.size() > kMaxLines) {
      return InPattern("pressure_advances",
                       fmt::format("{} value(s); a pattern has 2 ... {}", list.size(), kMaxLines));
    }
  } else if (config.pressure_advance_end_s <= config.pressure_advance_start_s) {
    return InPattern("pressure_advance_end",
                     fmt::format("{} s is not above pressure_advance_start = {} s",
                                 config.pressure_advance_end_s, config.pressure_advance_start_s));
  }
  std::vector<double> values = PressureAdvances(config);
  std::sort(values.begin(), values.end());
  const auto twin = std::adjacent_find(values.begin(), values.end());
  if (twin == values.end()) return std::nullopt;
  const bool listed = !config.pressure_advances_s.empty();
  return InPattern(listed ? "pressure_advances" : "pressure_advance_end",
                   fmt::format("{} s stands twice (values are written in steps of 1e-{} s)", *twin,
                               gcode::kPressureAdvanceDecimals));
}

/// Checks that each stretch is long enough to reach its speed and to slow down again.
Problem CheckSpeedsAreReached(const PatternConfig& config) {
  const std::vector<Segment>& segments = config.segments;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const double speed = segments[i].speed_mm_s;
    const double enter = i == 0 ? 0 : std::min(speed, segments[i - 1].speed_mm_s);
    const double leave = i + 1 == segments.size() ? 0 : std::min(speed, segments[i + 1].speed_mm_s);
    const double needed_mm =
        (2 * speed * speed - enter * enter - leave * leave) / (2 * config.acceleration_mm_s2);
    const double length_mm = segments[i].fraction * config.line_length_mm;
    if (needed_mm > length_mm) {
      return InPattern(
          "segments", fmt::format("segment {} is {:.3f} mm long, but reaching {} mm/s at {} mm/s^2 "
                                  "and leaving it again takes {:.3f} mm; lengthen it or slow down",
                                  i + 1, length_mm, speed, config.acceleration_mm_s2, needed_mm));
    }
  }
  return std::nullopt;
}

Problem CheckSegments(const PatternConfig& config) {
  constexpr std::size_t kMaxSegments = 20;
  constexpr double kMaxSpeed_mm_s = 1000;
  constexpr double kFractionTolerance = 1e-6;
  if (config.segments.size() < 2 || config.segments.size() > kMaxSegments) {
    return InPattern("segments", fmt::format("{} segment(s); a line has 2 ... {}",
                                             config.segments.size(), kMaxSegments));
  }
  double sum = 0;
  bool speed_changes = false;
  for (std::size_t i = 0; i < config.segments.size(); ++i) {
    const Segment& segment = config.segments[i];
    if (!(segment.fraction > 0 && segment.fraction <= 1)) {
      return InPattern("segments", fmt::format("fraction {} of segment {} is outside 0 ... 1",
                                               segment.fraction, i + 1));
    }
    if (!(segment.speed_mm_s >= 0.1 && segment.speed_mm_s <= kMaxSpeed_mm_s)) {
      return InPattern("segments",
                       fmt::format("speed {} mm/s of segment {} is outside 0.1 ... {} mm/s",
                                   segment.speed_mm_s, i + 1, kMaxSpeed_mm_s));
    }
    sum += segment.fraction;
    speed_changes = speed_changes || segment.speed_mm_s != config.segments[0].speed_mm_s;
  }
  if (std::abs(sum - 1) > kFractionTolerance) {
    return InPattern("segments", fmt::format("the fractions add up to {}, not to 1", sum));
  }
  if (!speed_changes) {
    return InPattern("segments",
                     fmt::format("all run at {} mm/s; pressure advance shows only where "
                                 "the speed changes",
                                 config.segments[0].speed_mm_s));
  }
  if (Problem problem = CheckSpeedsAreReached(config)) return problem;
  const auto too_short =
      FindShortFastSegment({config.segments, config.line_length_mm, config.acceleration_mm_s2});
  return too_short ? InPattern("acceleration", *too_short) : std::nullopt;
}

// Checks each pattern, if they differ.
Problem CheckAllSegments(const PatternConfig& config) {
  if (config.conditions.empty()) return CheckSegments(config);
  if (static_cast<int>(config.conditions.size()) != PatternCount(config)) {
    return InPattern("columns", fmt::format("{} conditions are none for {} patterns",
                                            config.conditions.size(), PatternCount(config)));
  }
  if (config.segments.empty()) return CheckSegments(config);
  for (int pattern = 0; pattern < PatternCount(config); ++pattern) {
    const PatternConfig one = SettingsOf(config, pattern);
    Problem problem = CheckFields(one);
    if (!problem) problem = CheckSegments(one);
    if (!problem) continue;
    const PatternConditions& at = config.conditions[static_cast<std::size_t>(pattern)];
    problem->message = fmt::format("at {} mm/s and {} mm/s^2: {}", at.fast_speed_mm_s,
                                   at.acceleration_mm_s2, problem->message);
    return problem;
  }
  return std::nullopt;
}

Problem CheckBead(const PatternConfig& config) {
  const double width_mm = config.line_width_mm;
  if (Problem problem = settings::FindBeadProblem(config, "pressure_advance_pattern",
                                                  config.layer_height_mm, width_mm)) {
    return problem;
  }
  if (config.line_spacing_mm <= width_mm) {
    return InPattern("line_spacing",
                     fmt::format("{} mm is not above line_width = {} mm: the lines would touch",
                                 config.line_spacing_mm, width_mm));
  }
  if (config.frame_margin_mm && *config.frame_margin_mm < width_mm) {
    return InPattern("frame_margin",
                     fmt::format("{} mm is below line_width = {} mm: the frame would "
                                 "lie on the outermost lines",
                                 *config.frame_margin_mm, width_mm));
  }
  if (config.frame_overlap_mm > width_mm) {
    return InPattern("frame_overlap", fmt::format("{} mm is above line_width = {} mm",
                                                  config.frame_overlap_mm, width_mm));
  }
  return std::nullopt;
}

Problem CheckWays(const PatternConfig& config) {
  if (config.lift_between_lines || config.alternate_directions) return std::nullopt;
  return InPattern("lift_between_lines",
                   "false needs alternate_directions = true: without, the nozzle would be dragged "
                   "along the line that it has just printed");
}

Problem CheckMark(const PatternConfig& config) {
  if (!config.corner_mark) return std::nullopt;
  if (config.frame_loops < 1) return InPattern("corner_mark", "needs a frame: frame_loops >= 1");
  const PatternGeometry geometry = Geometry(config);
  if (geometry.mark_beads >= kFewestMarkBeads) return std::nullopt;
  return InPattern("corner_mark",
                   fmt::format("finds room for {} bead(s) between frame and first line, {} are "
                               "needed: set frame_margin (now {} mm) to {:.1f} or more",
                               geometry.mark_beads, kFewestMarkBeads, geometry.side_to_loop_mm,
                               MarginForMark_mm(config)));
}

/// Returns the setting that moves an edge: the position if set, else the one that makes the print
/// wide.
const char* Culprit(bool positioned, const char* position, int count, const char* repeat,
                    const char* size) {
  return positioned ? position : count > 1 ? repeat : size;
}

Problem CheckEdges(const char* key, const char* axis, double lo_mm, double hi_mm, double bed_lo_mm,
                   double bed_hi_mm, double margin_mm) {
  constexpr double kSlack_mm = 1e-9;  // rounding of a pattern that just fits
  if (lo_mm >= bed_lo_mm - kSlack_mm && hi_mm <= bed_hi_mm + kSlack_mm) return std::nullopt;
  return InPattern(key, fmt::format("the print reaches {} = {:.3f} ... {:.3f} mm, but the bed less "
                                    "bed_margin = {} mm is {} ... {} mm",
                                    axis, lo_mm, hi_mm, margin_mm, bed_lo_mm, bed_hi_mm));
}

Problem CheckEllipse(const PatternConfig& config, const BoundsMm& print) {
  for (double x_mm : {print.min_x_mm, print.max_x_mm}) {
    for (double y_mm : {print.min_y_mm, print.max_y_mm}) {
      const double reach = settings::BedReach(config, x_mm, y_mm, config.bed_margin_mm);
      if (!(reach <= 1)) {
        return InPattern(Culprit(config.position_x_mm.has_value(), "position_x", config.columns,
                                 "columns", "line_length"),
                         fmt::format("the print's corner ({:.3f}, {:.3f}) mm lies at {:.3f} of the "
                                     "round bed's radius less bed_margin = {} mm; at most 1",
                                     x_mm, y_mm, reach, config.bed_margin_mm));
      }
    }
  }
  return std::nullopt;
}

Problem CheckPark(const PatternConfig& config) { return settings::FindParkProblem(config); }

Problem CheckFit(const PatternConfig& config) {
  const std::size_t lines = PressureAdvances(config).size() *
                            static_cast<std::size_t>(config.columns) *
                            static_cast<std::size_t>(config.rows);
  if (const int patterns = PatternCount(config);
      patterns < 1 || patterns > config.columns * config.rows) {
    return InPattern("columns", fmt::format("{} x {} places are none for {} patterns",
                                            config.columns, config.rows, patterns));
  }
  if (lines > kMaxLinesInAll) {
    return InPattern("columns", fmt::format("{} x {} patterns have {} lines; at most {}",
                                            config.columns, config.rows, lines, kMaxLinesInAll));
  }
  const BoundsMm print = OuterBounds(config);
  const double margin_mm = config.bed_margin_mm;
  const double bed_x_mm = config.bed_origin_x_mm;
  const double bed_y_mm = config.bed_origin_y_mm;
  if (Problem problem = CheckEdges(Culprit(config.position_x_mm.has_value(), "position_x",
                                           config.columns, "columns", "line_length"),
                                   "x", print.min_x_mm, print.max_x_mm, bed_x_mm + margin_mm,
                                   bed_x_mm + config.bed_size_x_mm - margin_mm, margin_mm)) {
    return problem;
  }
  if (Problem problem = CheckEdges(
          Culprit(config.position_y_mm.has_value(), "position_y", config.rows, "rows",
                  config.pressure_advances_s.empty() ? "line_count" : "pressure_advances"),
          "y", print.min_y_mm, print.max_y_mm, bed_y_mm + margin_mm,
          bed_y_mm + config.bed_size_y_mm - margin_mm, margin_mm)) {
    return problem;
  }
  if (config.bed_shape == settings::BedShape::kEllipse) return CheckEllipse(config, print);
  return std::nullopt;
}

Problem CheckUserGcode(const PatternConfig& config) {
  for (const auto& [key, text] :
       {std::pair{"start_gcode", &config.start_gcode}, std::pair{"end_gcode", &config.end_gcode},
        std::pair{"idle_gcode", &config.idle_gcode}}) {
    const auto expanded = gcode::ExpandPlaceholders(*text, PatternPlaceholders(config));
    if (!expanded) return InSection("printer", key, expanded.error().message);
  }
  return std::nullopt;
}

Problem CheckDrive(const PatternConfig& config) {
  const bool matters = config.dialect == gcode::Dialect::kRepRapFirmware;
  if (!matters || config.extruder_drive >= 0) return std::nullopt;
  const gcode::SelectedTool tool = gcode::ToolSelectedBy(config.start_gcode);
  if (tool.unknown.empty()) return std::nullopt;
  return InSection(
      "printer", "extruder_drive",
      fmt::format("must be set: which tool prints behind '{}' of start_gcode cannot be "
                  "known, and M572 needs the drive that M563 gives that tool (0 with "
                  "one extruder)",
                  tool.unknown));
}

}  // namespace

std::optional<settings::SettingProblem> FindProblem(const PatternConfig& config) {
  // Checks ranges first: later checks divide and multiply.
  for (auto check :
       {CheckFirmwareRange, CheckFields, CheckPressureAdvances, CheckAllSegments, CheckBead,
        CheckWays, CheckMark, CheckFit, CheckPark, CheckUserGcode, CheckDrive}) {
    if (Problem problem = check(config)) return problem;
  }
  return std::nullopt;
}

Result<void> Validate(const PatternConfig& config) {
  if (const Problem problem = FindProblem(config)) {
    return Fail(fmt::format("[{}] {}: {}", problem->section, problem->key, problem->message));
  }
  return {};
}

}  // namespace trammel::pressure_advance
