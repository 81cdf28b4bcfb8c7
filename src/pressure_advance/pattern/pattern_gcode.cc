#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/check.h"
#include "gcode/dialect.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

using gcode::FormatNumber;

constexpr int kPositionDecimals = 3;  // 1 um
constexpr int kFilamentDecimals = 5;  // 0.01 um of filament: no drift even in short segments
constexpr int kFeedDecimals = 2;      // mm/min

/// Builds the file line by line.
class Writer {
 public:
  explicit Writer(bool relative_filament) : relative_filament_(relative_filament) {}

  void Line(std::string_view text) {
    out_ += text;
    out_ += '\n';
  }
  void Lines(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) Line(line);
  }
  /// Writes the user's own text, ended by a line end.
  void Block(std::string_view text) {
    out_ += text;
    if (!text.empty() && text.back() != '\n') out_ += '\n';
  }

  void Motion(const Move& move) {
    const double before_mm = filament_mm_;
    filament_mm_ += move.filament_mm;
    std::string line = move.kind == MoveKind::kTravel ? "G0" : "G1";
    if (move.to.x_mm != move.from.x_mm)
      line += " X" + FormatNumber(move.to.x_mm, kPositionDecimals);
    if (move.to.y_mm != move.from.y_mm)
      line += " Y" + FormatNumber(move.to.y_mm, kPositionDecimals);
    if (move.to.z_mm != move.from.z_mm)
      line += " Z" + FormatNumber(move.to.z_mm, kPositionDecimals);
    if (move.filament_mm != 0) {
      // Differences of rounded sums do not drift.
      line += " E" + FormatNumber(relative_filament_ ? Rounded(filament_mm_) - Rounded(before_mm)
                                                     : filament_mm_,
                                  kFilamentDecimals);
    }
    Line(line + " F" + FormatNumber(move.speed_mm_s * 60, kFeedDecimals));
  }

  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  [[nodiscard]] static double Rounded(double filament_mm) {
    constexpr double kUnitsPerMm = 1e5;  // kFilamentDecimals
    return std::round(filament_mm * kUnitsPerMm) / kUnitsPerMm;
  }

  std::string out_;
  bool relative_filament_;
  double filament_mm_ = 0;  ///< since the file's begin
};

void WriteHead(const PatternLayout& layout, const PatternConfig& config, Writer& writer) {
  const PatternSummary summary = Summarise(layout, config);
  writer.Line("; trammel: pressure advance pattern");
  writer.Line(fmt::format("; dialect {}, {} pattern(s), {} line(s)", ToString(config.dialect),
                          layout.patterns.size(), layout.lines.size()));
  writer.Line("; heated to " + settings::DescribeTemperatures(config));
  writer.Line(fmt::format(
      "; bead {} x {} mm, {} mm of {} mm filament per mm", FormatNumber(config.line_width_mm, 4),
      FormatNumber(config.layer_height_mm, 4), FormatNumber(FilamentPerMm(config), 6),
      FormatNumber(config.filament_diameter_mm, 3)));
  writer.Line(fmt::format(
      "; prints within X {} ... {}, Y {} ... {}", FormatNumber(layout.printed.min_x_mm, 3),
      FormatNumber(layout.printed.max_x_mm, 3), FormatNumber(layout.printed.min_y_mm, 3),
      FormatNumber(layout.printed.max_y_mm, 3)));
  double fastest_mm_s = 0, acceleration_mm_s2 = 0;
  for (int pattern = 0; pattern < PatternCount(config); ++pattern) {
    const PatternConfig one = SettingsOf(config, pattern);
    fastest_mm_s = std::max(fastest_mm_s, FastSpeed_mm_s(one));
    acceleration_mm_s2 = std::max(acceleration_mm_s2, one.acceleration_mm_s2);
  }
  // A lower limit would silently print slower lines than planned.
  writer.Line(fmt::format("; needs a printer that is allowed {} mm/s and {} mm/s^2",
                          FormatNumber(fastest_mm_s, 2), FormatNumber(acceleration_mm_s2, 1)));
  writer.Line(fmt::format("; filament {} mm, {} s without heating",
                          FormatNumber(summary.filament_mm, 1), FormatNumber(summary.time_s, 0)));
  writer.Line("; afterwards " + DescribeAfterwards(config));
}

/// Writes modes, whose state after the start G-code is unknown, and the limits of the pattern.
void WriteModes(const PatternConfig& config, Writer& writer) {
  writer.Lines(SaveStateCommands(config.dialect));
  writer.Lines(ModeCommands(config.dialect));
  if (config.dialect == gcode::Dialect::kKlipper) {
    // Otherwise Klipper slows moves down until half of each is cruised, and the lines would change
    // speed elsewhere than the analysis assumes.
    writer.Line("; every move may be all acceleration: the speed changes are what is measured");
  }
  writer.Line(LimitCommand(config.dialect, config.acceleration_mm_s2, 0.0));
  writer.Line("; the nozzle rises before its first travel");
  writer.Line(fmt::format("G1 Z{} F{}", FormatNumber(ApproachZ_mm(config), kPositionDecimals),
                          FormatNumber(config.z_speed_mm_s * 60, kFeedDecimals)));
}

void SetPressureAdvance(const PatternConfig& config, double pressure_advance_s, Writer& writer) {
  writer.Lines(PressureAdvanceCommands(config.dialect, pressure_advance_s,
                                       {config.advance_motors, DriveOf(config)}));
}

void WriteMoves(const PatternLayout& layout, const PatternConfig& config, Writer& writer) {
  const Move* previous = nullptr;
  for (const Move& move : layout.moves) {
    if (previous == nullptr || move.pattern != previous->pattern || move.line != previous->line) {
      if (move.line >= 0) {
        const PatternLine& line = layout.lines[static_cast<std::size_t>(move.line)];
        const std::string value =
            FormatNumber(line.pressure_advance_s, gcode::kPressureAdvanceDecimals);
        writer.Line(fmt::format("; line {} of pattern {}", move.line, move.pattern));
        SetPressureAdvance(config, line.pressure_advance_s, writer);
        writer.Lines(DisplayCommands(config.dialect, "PA " + value));
      } else {
        if (move.pattern >= 0) writer.Line(fmt::format("; frame of pattern {}", move.pattern));
        if (move.pattern >= 0 && !config.conditions.empty()) {
          writer.Line(LimitCommand(config.dialect,
                                   SettingsOf(config, move.pattern).acceleration_mm_s2, 0.0));
        }
        SetPressureAdvance(config, move.pressure_advance_s, writer);
      }
    }
    writer.Motion(move);
    previous = &move;
  }
}

double LastAcceleration_mm_s2(const PatternConfig& config) {
  return SettingsOf(config, PatternCount(config) - 1).acceleration_mm_s2;
}

void WriteRestore(const PatternConfig& config, Writer& writer) {
  writer.Line(gcode::WaitForMovesCommand());
  writer.Lines(DisplayCommands(config.dialect, ""));
  if (config.restore_pressure_advance_s) {
    SetPressureAdvance(config, *config.restore_pressure_advance_s, writer);
  }
  // Klipper's share is restored in any case: before 2024 it is set by the acceleration in force.
  if (config.restore_acceleration_mm_s2 || config.dialect == gcode::Dialect::kKlipper) {
    writer.Line(LimitCommand(
        config.dialect, config.restore_acceleration_mm_s2.value_or(LastAcceleration_mm_s2(config)),
        config.restore_minimum_cruise_ratio));
  }
  writer.Lines(RestoreStateCommands(config.dialect));
}

}  // namespace

std::string DescribeAfterwards(const PatternConfig& config) {
  return gcode::DescribeAfterwards(config.dialect,
                                   {{"pressure advance", config.frame_pressure_advance_s,
                                     config.restore_pressure_advance_s, "restore_pressure_advance"},
                                    {"acceleration", LastAcceleration_mm_s2(config),
                                     config.restore_acceleration_mm_s2, "restore_acceleration"}});
}

std::string WriteGcode(const PatternLayout& layout, const PatternConfig& config) {
  const std::vector<gcode::Placeholder> known = PatternPlaceholders(config);
  const auto expand = [&](const char* key, const std::string& text) {
    Result<std::string> expanded = gcode::ExpandPlaceholders(text, known);
    TRAMMEL_CHECK(expanded.has_value(), "{}: {}", key, expanded.error().message);
    return *std::move(expanded);
  };
  Writer writer(gcode::WordsOf(config.dialect).relative_filament);
  WriteHead(layout, config, writer);
  writer.Line("; start G-code");
  writer.Block(expand("start_gcode", config.start_gcode));
  writer.Lines(settings::HeatBehind(config.start_gcode, config));
  writer.Line("; pattern");
  WriteModes(config, writer);
  WriteMoves(layout, config, writer);
  WriteRestore(config, writer);
  if (config.finish == Finish::kIdle) {
    writer.Line("; idle G-code");
    writer.Block(expand("idle_gcode", config.idle_gcode));
  } else {
    writer.Line("; end G-code");
    writer.Block(expand("end_gcode", config.end_gcode));
  }
  return writer.Take();
}

}  // namespace trammel::pressure_advance
