// Printed pattern: from settings to moves, G-code, and time and filament.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/pattern/pattern_config.h"

namespace trammel::pressure_advance {

/// Position of the nozzle's tip in the printer's coordinates.
struct PointMm {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
};

struct BoundsMm {
  double min_x_mm = 0;
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;
};

enum class MoveKind {
  kTravel,     ///< x and y, retracted, without filament
  kLift,       ///< z only, upwards
  kLower,      ///< z only, downwards
  kRetract,    ///< filament only, backwards
  kUnretract,  ///< filament only, forwards again
  kPrime,      ///< filament only: fills the nozzle before a frame
  kFrame,      ///< extrudes a side of a frame
  kLine,       ///< extrudes a segment of a line
};

struct Move {
  MoveKind kind = MoveKind::kTravel;
  PointMm from;
  PointMm to;
  double speed_mm_s = 0;          ///< of the nozzle, or of filament that moves alone
  double filament_mm = 0;         ///< driven forwards; negative: drawn back
  double width_mm = 0;            ///< bead width; 0: no bead
  double pressure_advance_s = 0;  ///< active during this move
  int pattern = -1;               ///< index of the pattern; -1 while parking
  int line = -1;  ///< index into PatternLayout::lines that this move prints or leads to; -1: none
  int segment = -1;  ///< index into the config's segments; -1 outside lines
};

struct PatternLine {
  int pattern = 0;  ///< row-major, front left first
  double pressure_advance_s = 0;
  PointMm start;  ///< start of printing
  PointMm end;
};

/// Moves in order of execution, each starting at the end of the one before.
struct PatternLayout {
  std::vector<Move> moves;
  std::vector<PatternLine> lines;  ///< in print order
  std::vector<BoundsMm> patterns;  ///< outer edge of each pattern's beads
  BoundsMm printed;                ///< outer edge of everything printed
};

/// REQUIRES Validate(config). The first move starts above the middle of the bed, since the nozzle's
/// position after the start G-code is unknown.
[[nodiscard]] PatternLayout LayOut(const PatternConfig& config);

/// Returns the complete file: start G-code, modes and limits, moves, end or idle G-code. Absolute
/// positions, E as the firmware's files have it, both set explicitly. REQUIRES a layout from
/// LayOut(config), and temperatures (settings::FindTemperatureProblem).
[[nodiscard]] std::string WriteGcode(const PatternLayout& layout, const PatternConfig& config);

/// Describes in a sentence the settings that remain changed after the print.
[[nodiscard]] std::string DescribeAfterwards(const PatternConfig& config);

/// Parts of a print's time.
struct PatternTime {
  double lines_s = 0;       ///< while lines are extruded
  double frame_s = 0;       ///< while frame, mark and prime are
  double between_s = 0;     ///< from one to the next: travel, lift, retraction
  double to_and_fro_s = 0;  ///< down to the plate and up again

  [[nodiscard]] double total_s() const { return lines_s + frame_s + between_s + to_and_fro_s; }
};

struct PatternSummary {
  double filament_mm = 0;            ///< used: forwards less backwards
  std::optional<double> filament_g;  ///< absent where nothing tells its density
  PatternTime time;                  ///< parts of `time_s`
  double time_s = 0;                 ///< moves with trapezoidal speed; no heating, no homing
  double peak_flow_mm3_s = 0;        ///< the hot end must melt this much
  BoundsMm printed;
  double max_z_mm = 0;
};

/// Estimates time by trapezoids with one acceleration for all axes and Klipper's junction rule at a
/// square corner velocity of 5 mm/s, its default. REQUIRES a layout from LayOut(config).
[[nodiscard]] PatternSummary Summarise(const PatternLayout& layout, const PatternConfig& config);

}  // namespace trammel::pressure_advance
