// Reads laser videos of a scan into line profiles.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/laser/stripe_sight.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

/// Draws each area's sigma half way (geometric mean), by a factor of 1.5 at most, to the median
/// over the scan's lines of their median sigmas.
///
/// A frame's foretold noise and a line's scatter, told from some thirty differences, are themselves
/// uncertain by about as much as they differ within a scan of one filament on one plate: as weights
/// they cost more than they tell. What lies far off (a string across a line) stays so.
/// @param lines  of one scan, all measured in the same unit; samples that are not seen stay so.
void ShareScatter(std::span<LineProfile> lines);

struct LaserEyeOptions {
  /// Rows stand for themselves: the area averages over them anyway, and a bead of a few rows must
  /// not be blunted. A narrow filter keeps the plate's light out of the bead's rows.
  vision::LaserLineOptions line{.row_smoothing = 0, .as_good = 1.15};
  double least_contrast = 3;  ///< of a laser line against what is beside it, in noise sigmas; the
                              ///< best path through pure noise reaches 2
  std::size_t model_frames = 8;   ///< >= 1; frames from which the stripe's looks are learnt
  std::size_t fewest_frames = 8;  ///< >= 3; in a sweep, on the line and in motion
};

/// What the eye read from one sweep, in print direction whichever way it was swept.
struct SweepReading {
  LineProfile profile;
  HeightMap heights;  ///< relative to the plate; empty where the line is unusable
  vision::StripeModel stripe;
  StripeSight sight;
  std::vector<std::size_t> frame;   ///< per map column: index of the frame in the recording
  std::size_t still_frames = 0;     ///< left out because the laser stood still
  std::size_t unplaced_frames = 0;  ///< left out because the recording gives them no position
  std::size_t off_line_frames = 0;  ///< left out because the laser was past the line's ends
  std::size_t cut_off_frames = 0;   ///< gaps because the bead reaches out of the picture
};

/// Turns a frame so that the laser line runs down it: a copy for lines that move along x, the
/// transpose for those that move along y.
void TurnUpright(const BgrView& view, AxisDirection height_direction, Frame& upright);

/// Reads one sweep.
///
/// Positions: the first frame in motion stands at scan.line_start_mm; frames in which the laser
/// stands still before it starts or after it stopped are left out, and so are frames past the ends
/// of the line. Where the line has frame_positions_mm, they hold instead, and frames without one
/// are not looked at.
/// @param frames  upright and cropped, in the order of recording; those that are looked at all of
///                one size. As many as the line has positions, if it has any.
/// A sweep that holds no laser, no bead or too few frames comes back with profile.unusable.
[[nodiscard]] SweepReading ReadSweep(std::span<const Frame> frames, const Scan& scan,
                                     const ScanLine& line, const LaserEyeOptions& options,
                                     vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance
