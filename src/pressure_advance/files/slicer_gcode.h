// Finds pressure-advance test patterns in the G-code of a slicer or a generator.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "gcode/dialect.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::files {

using pressure_advance::PatternForm;

/// Pattern as commanded. Candidates in the order in which they lie: lines from the front of the
/// bed, chevrons towards their apexes.
struct SlicerPattern {
  PatternForm form = PatternForm::kLines;
  std::vector<double> pressure_advance_s;
  double spacing_mm = 0;                            ///< between neighbouring candidates
  double length_mm = 0;                             ///< of a line, or of one arm
  std::vector<pressure_advance::Segment> segments;  ///< of lines
  bool to_and_fro = false;                          ///< lines are not printed in one direction
  double speed_mm_s = 0;                            ///< of chevrons
  std::optional<double> acceleration_mm_s2;         ///< absent: the file sets none
  double smooth_time_s = 0;                         ///< of Klipper's and Prusa's; 0: none
  std::optional<double> layer_height_mm;
  double flow_mm3_s = 0;  ///< volume of filament over time, at the (fast) speed; of 1.75 mm
                          ///< filament where the file's settings have no filament_diameter
  double x_mm = 0;        ///< middle of the pattern on the bed
  double y_mm = 0;
  double heading_rad = 0;  ///< of the apexes, from +x counter-clockwise; 0 of lines
  std::string plate;       ///< of an archive: plate_1 and so on; else empty
};

struct SlicerPrint {
  std::vector<SlicerPattern> patterns;  ///< left to right, then front to back
  /// Absent where the commands do not say: M572 S without D is RepRapFirmware's or Prusa's.
  std::optional<gcode::PrintedBy> printed_by;
  double filament_mm = 1.75;  ///< diameter; the usual one where the settings have none
};

/// Largest file that is read: a plate full of patterns with all comments has 30 MB.
inline constexpr std::size_t kLargestSlicerGcode = std::size_t{128} << 20;

/// Recognises candidates by their moves alone: three collinear extrusions slow, fast, slow, or two
/// equally long ones at a right angle, under one pressure advance. Reads relative and absolute
/// positions, feed, acceleration and pressure advance of Klipper, Marlin and RepRapFirmware;
/// ignores all other commands. Errors (kInput): no pattern; a candidate's value that cannot be
/// known (no pressure advance was set); a smooth time that changes instead.
[[nodiscard]] Result<SlicerPrint> FindSlicerPatterns(std::string_view gcode,
                                                     const std::string& file);

/// Reads a text of G-code, or the plates of a 3MF archive; then as above. Patterns of an archive
/// are listed plate by plate.
/// @param plate  the only one that is read, by its name or its number; empty: all
/// Errors: also binary G-code, a plate that is not there, and those of ReadGcodeArchive.
[[nodiscard]] Result<SlicerPrint> ReadSlicerGcode(const std::filesystem::path& file,
                                                  const std::string& plate = "");

}  // namespace trammel::files
