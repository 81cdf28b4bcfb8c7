// Beads of prints with several layers: what they rest on, rounded corners, neighbours that push.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/print/bead.h"
#include "sim/print/bed.h"
#include "sim/print/extruder.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/laid_beads.h"
#include "sim/print/planner.h"

namespace trammel::sim {

/// Nozzle's path over one stroke, at equidistant nodes.
struct StrandPath {
  std::vector<Position> nozzle;
  std::vector<double> base_mm;  ///< top of the filament below, above the plate
  std::vector<double> gap_mm;   ///< from there to the nozzle
};

/// Sharp corner of a stroke; its inner angle is between the two arms.
struct PathCorner {
  std::size_t node = 0;  ///< nearest one
  double x_mm = 0;       ///< as commanded
  double y_mm = 0;
  double inside_x = 0;  ///< unit vector that halves the inner angle
  double inside_y = 0;
  double half_angle_rad = 0;  ///< half of the inner angle
};

/// Returns the stroke's corners of 60 … 120 degrees.
[[nodiscard]] std::vector<PathCorner> FindCorners(std::span<const TimedMove> plan,
                                                  const Stroke& stroke, double spacing_mm);

/// Rounds a path as belts and input shaping do: a Gaussian mean along it, narrower towards the
/// ends.
void RoundPath(std::vector<Position>& nozzle, double spacing_mm, double sigma_mm);

/// Drags half of the surplus over a full bead along: the nozzle's flat end pushes it ahead and
/// leaves it over the next millimetres. Conserves the volume. REQUIRES one full area per node.
void CarryOn(std::span<double> area_mm2, std::span<const double> full_mm2, double spacing_mm);

/// Sets base and gap where filament lies below the nozzle. A bead spans a hole in the layer below.
void RestOn(const LaidBeads& laid, StrandPath& path);

/// Fills the inner angle of corners with filament from both arms: a melt does not follow a concave
/// edge of less than radius_mm. Conserves the volume; leaves out corners with another bead of the
/// layer within half a millimetre, and broken ones.
/// @param area_mm2  per node; shrinks near the corners.
/// @returns Strands with area, width and height.
[[nodiscard]] std::vector<Strand> FillCorners(std::span<const PathCorner> corners,
                                              const StrandPath& path, double radius_mm,
                                              const LaidBeads& laid, std::span<double> area_mm2);

struct PushedStrand {
  Strand strand;
  std::vector<LaidPiece> pieces;  ///< to add to the laid beads
};

/// Shapes a bead, and moves it to the free side where neighbours of its layer take its room, or to
/// a neighbour that it nearly touches. Where it moves out of a bend it has further to go and
/// becomes thinner: the volume is conserved.
[[nodiscard]] PushedStrand PushAside(const LaidBeads& laid, const StrandPath& path,
                                     std::span<const double> area_mm2, double spacing_mm,
                                     const BeadOptions& options);

}  // namespace trammel::sim
