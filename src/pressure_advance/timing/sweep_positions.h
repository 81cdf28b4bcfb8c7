// Models the sweep's motion and the position of each frame.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

/// Position and speed of a head that is at rest before, between and after its moves.
/// REQUIRES a non-empty list, in order of time. Cost: O(log n).
struct HeadState {
  double position_mm = 0;
  double speed_mm_s = 0;  ///< signed
  bool standing = true;   ///< outside all moves
};
[[nodiscard]] HeadState HeadAt(std::span<const LineMove> moves, double time_s);

/// Returns the end of the last move.
[[nodiscard]] double MotionEnd_s(std::span<const LineMove> moves);

/// Returns the maximum absolute speed of all moves.
[[nodiscard]] double LargestSpeed_mm_s(std::span<const LineMove> moves);

/// True if the head moves at its largest speed, to within a fraction of it, all the time from..to.
[[nodiscard]] bool IsSteady(std::span<const LineMove> moves, double from_s, double to_s,
                            double tolerance);

/// True if the head is at rest at some moment from..to.
[[nodiscard]] bool StandsWithin(std::span<const LineMove> moves, double from_s, double to_s);

/// Frames at the ends of a sweep in which the camera was at rest.
struct StillFrames {
  std::size_t first = 0;  ///< leading frames without motion to the next; the last of these is where
                          ///< the sweep begins
  std::size_t last = 0;   ///< trailing frames that repeat the one before them
  bool all = false;       ///< no two frames differ: the camera or the machine hung
};

/// Finds frames at rest: a moving laser crosses new speckle with every frame; one at rest shows the
/// same picture twice. A stretch counts as still only if its frames differ by less than half of the
/// difference of nearly every other pair. So a sweep over a smooth bead without speckle loses
/// nothing.
/// @param frames  those of `order` all of one size; no other is read.
/// @param order   indices of consecutive frames; `first` and `last` count in it.
[[nodiscard]] StillFrames FindStillFrames(std::span<const Frame> frames,
                                          std::span<const std::size_t> order);

/// Returns the usable frames: those with a position of their own, or all if the line has none.
/// REQUIRES as many positions, if any, as frames.
[[nodiscard]] std::vector<std::size_t> PlacedFrames(const ScanLine& line, std::size_t frame_count);

/// Returns the laser's position in each frame of a line without frame_positions_mm, mm from the
/// printed start in print direction: the frame `begin` is where scan.line_start_mm was measured.
/// @param frame_count  frames in the sweep, >= 1; line.frame_times_s, if given, has as many.
/// An opposite sweep runs backwards from line_start_mm, or from the line's other end if more of the
/// sweep is then on the line.
[[nodiscard]] std::vector<double> SweepPositions(const Scan& scan, const ScanLine& line,
                                                 std::size_t frame_count, std::size_t begin);

/// True if the sweep runs against the print: falling positions, or else the opposite direction.
[[nodiscard]] bool SweepsBackwards(const ScanLine& line);

}  // namespace trammel::pressure_advance
