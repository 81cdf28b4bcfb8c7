// Writes the G-code of pressure-advance patterns as OrcaSlicer, Ellis' tool and Marlin's tool do.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

enum class PatternKind {
  kOrcaLine,     ///< OrcaSlicer and Bambu Studio, "PA Line": slow, fast, slow
  kOrcaPattern,  ///< OrcaSlicer and Bambu Studio, "PA Pattern": chevrons of four layers
  kEllis,        ///< Ellis' tool: chevrons with a frame of four loops
  kMarlinLines,  ///< Marlin's K-factor tool; with Klipper's commands Ellis' older lines tool
  kOrcaBatch,    ///< OrcaSlicer 2.3, "PA Pattern" of several speeds and accelerations on one plate
};

/// Dialect of the pressure-advance command and of the limits.
enum class PatternFirmware { kKlipper, kMarlin, kRepRap, kBambu, kPrusa };

/// Settings of one pattern. PatternDefaults fills in what each tool proposes.
struct PatternOptions {
  PatternKind kind = PatternKind::kOrcaLine;
  PatternFirmware firmware = PatternFirmware::kKlipper;
  double start_s = 0;  ///< 0 … 10
  double end_s = 0.1;  ///< > start_s, at most 10
  double step_s = 0.002;

  double slow_mm_s = 20;             ///< lines only, 1 … 1000
  double fast_mm_s = 100;            ///< fast part, or the walls of upper layers; 1 … 1000
  double first_layer_mm_s = 30;      ///< 1 … 1000
  double acceleration_mm_s2 = 3000;  ///< 50 … 100000
  double corner_mm_s = 0;     ///< square corner velocity or jerk, 0 … 50; 0: the G-code sets none
  double smooth_time_s = -1;  ///< Klipper and Prusa, 0 … 0.2; below 0: the G-code sets none
  double nozzle_mm = 0.4;     ///< 0.2 … 1
  double first_layer_mm = 0.2;  ///< 0.05 … 0.8
  double layer_mm = 0.2;        ///< 0.05 … 0.8
  double flow_ratio = 1;        ///< 0.5 … 1.5
  double bed_x_mm = 250;        ///< 100 … 1000
  double bed_y_mm = 250;        ///< 100 … 1000
  bool round_bed = false;       ///< Marlin lines: the bed's centre is the origin
  int rotation_deg = 0;         ///< Marlin lines: a multiple of 45
  bool numbers = true;
  bool frame = true;       ///< Marlin lines: bars at both ends of the lines
  bool prime = false;      ///< Marlin lines: two thick lines beside the pattern
  bool alternate = false;  ///< Marlin lines: every second line runs backwards; no frame
  /// Orca's lines by age. 2: 2.3.1 and later, bars at both ends; 1: before, one bar and the tab; 0:
  /// the first ones, free ends with ticks, numbers on the plate.
  int bars = 2;
  int walls = 3;          ///< chevrons, 1 … 8
  int layers = 4;         ///< chevrons, 2 … 10
  double spacing_mm = 2;  ///< chevrons: gap between two of them along x, 0.5 … 20
  double nozzle_c = 215;  ///< 150 … 400
  double plate_c = 60;    ///< 0 … 150
  /// Orca's batch: 1 … 4 of each, in place of fast_mm_s and acceleration_mm_s2.
  std::vector<double> speeds_mm_s = {100};
  std::vector<double> accelerations_mm_s2 = {3000};
  bool absolute_e = false;  ///< M82 in place of M83
  bool comments = true;     ///< the comments that slicers leave out unless verbose
};

struct SlicerPattern {
  std::string gcode;
  std::vector<double> pressure_advance_s;  ///< as printed, in order
};

/// Returns the kind of a name, "orca-line", "orca-pattern", "ellis", "marlin-lines" or
/// "orca-batch". Error (kInput): another name.
[[nodiscard]] Result<PatternKind> ParsePatternKind(std::string_view name);
[[nodiscard]] std::string_view ToString(PatternKind kind);
/// "klipper", "marlin", "rrf", "bambu" or "prusa". Error (kInput): another name.
[[nodiscard]] Result<PatternFirmware> ParsePatternFirmware(std::string_view name);

/// Returns what the tool proposes for a direct extruder with a 0.4 mm nozzle.
[[nodiscard]] PatternOptions PatternDefaults(PatternKind kind);

/// Returns the values that the tool prints, by its own rule: Orca cuts its lines to the bed's depth
/// and prints one chevron more where the quotient rounds up; Marlin's sum of steps may miss the
/// last line. Error (kInput): a setting outside its bounds, more than 400 values.
[[nodiscard]] Result<std::vector<double>> PatternValues(const PatternOptions& options);

/// Writes the pattern in the middle of the bed. Geometry, order, labels and comments follow each
/// tool (docs/reference/simulated-patterns.md). Error (kInput): as PatternValues; a pattern that is
/// larger than the bed.
[[nodiscard]] Result<SlicerPattern> WriteSlicerPattern(const PatternOptions& options);

}  // namespace trammel::sim
