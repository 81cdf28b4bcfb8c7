// Reads laser videos of a scan into line profiles.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/laser/stripe_observation.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

/// Shrinks each area's sigma half way (geometric mean), by a factor of 1.5 at most, to the median
/// over the scan's lines of their median sigmas.
///
/// A frame's predicted noise and a line's scatter, from some thirty differences, are uncertain.
/// Their errors are about as large as their variation within a scan of one filament on one plate:
/// as weights they would do more harm than good. A far outlier (a string across a line) remains
/// one.
/// @param lines  of one scan, all measured in the same unit; unseen samples are unchanged.
void ShareScatter(std::span<LineProfile> lines);

struct LaserReaderOptions {
  /// No smoothing over rows: the area averages over them anyway, and a bead of a few rows must not
  /// be blurred. A narrow filter keeps the plate's light out of the bead's rows.
  vision::LaserLineOptions line{.row_smoothing = 0, .as_good = 1.15};
  double min_contrast = 3;  ///< of a laser line against what is beside it, in noise sigmas; the
                            ///< best path through pure noise reaches 2
  std::size_t model_frames = 8;   ///< >= 1; frames from which the stripe's looks are learnt
  std::size_t fewest_frames = 8;  ///< >= 3; in a sweep, on the line and in motion
};

/// Profile and heights from one sweep, in print direction whichever way it was swept.
struct SweepReading {
  LineProfile profile;
  HeightMap heights;  ///< relative to the plate; empty where the line is unusable
  vision::StripeModel stripe;
  StripeObservation observation;
  std::vector<std::size_t> frame;   ///< per map column: index of the frame in the recording
  std::size_t still_frames = 0;     ///< left out because the laser stood still
  std::size_t unplaced_frames = 0;  ///< left out because the recording gives them no position
  std::size_t off_line_frames = 0;  ///< left out because the laser was past the line's ends
  std::size_t cut_off_frames = 0;   ///< gaps because the bead reaches out of the picture
};

/// Rotates a frame so that the laser line runs down it: a copy for lines that move along x, the
/// transpose for those that move along y.
void TurnUpright(const BgrView& view, AxisDirection height_direction, Frame& upright);

/// Reads one sweep.
///
/// Positions: the first moving frame is at scan.line_start_mm. Frames in which the laser is at rest
/// before the start or after the stop are omitted, and so are frames past the line's ends. If the
/// line has frame_positions_mm, these apply instead, and frames without one are not read.
/// @param frames  upright and cropped, in the order of recording; those that are read all of
///                one size. As many as the line has positions, if it has any.
/// A sweep with no laser, no bead or too few frames has profile.unusable.
[[nodiscard]] SweepReading ReadSweep(std::span<const Frame> frames, const Scan& scan,
                                     const ScanLine& line, const LaserReaderOptions& options,
                                     vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance
