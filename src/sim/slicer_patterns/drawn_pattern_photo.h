// Draws a whole virtual world around another tool's pattern: printer, filament, plate, phone.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "sim/photo/photo_camera.h"
#include "sim/print/bed.h"
#include "sim/slicer_patterns/slicer_pattern.h"

namespace trammel::sim {

struct PatternPhotoOptions {
  int width_px = 4032;   ///< 64 … 20000
  int height_px = 3024;  ///< 64 … 20000
  PhotoDistortion distortion;
  /// K* is uniform between these shares of the tested range: 0 its start, 1 its end. Beyond 1 the
  /// answer is outside of what was printed.
  double least_share = 0.1;
  double most_share = 0.9;
  double least_exponent = 0.5;  ///< of the storage law, 0.2 … 1
  double most_exponent = 1;
  std::optional<PatternOptions> pattern;  ///< in place of a drawn one
  std::optional<PhotoScene> scene;        ///< in place of a drawn one
};

struct DrawnPatternPhoto {
  PatternKind kind = PatternKind::kOrcaLine;
  PatternOptions pattern;
  std::string gcode;
  std::vector<double> values;  ///< pressure advance of each line or chevron, s, in print order
  /// pressure_advance_s: lines: the secant of the storage law between slow and fast; chevrons:
  /// between standstill and the walls' flow. tangent_s: the law's slope at the fast flow.
  PrintTruth truth;
  double exponent = 1;
  PhotoScene scene;
  PhotoTraits phone;
  Frame photo;  ///< before JPEG; phone.jpeg_quality is the phone's
};

/// Draws the settings of a pattern as people print it: speed, acceleration, firmware, age of the
/// tool.
[[nodiscard]] PatternOptions DrawPatternOptions(PatternKind kind, Random& random);

/// Draws, prints and photographs a pattern. Equal seeds give equal worlds.
/// Errors (kInput): options outside their bounds.
/// Cost: about 5 s of one core for 12 million pixels, 1.5 s for 2 million.
[[nodiscard]] Result<DrawnPatternPhoto> DrawPatternPhoto(PatternKind kind, std::uint64_t seed,
                                                         const PatternPhotoOptions& options);

}  // namespace trammel::sim
