// Models the sweep's motion and where each frame was taken.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/timing/sweep_timing.h"

namespace trammel::pressure_advance {

/// Position and speed of a head that stands before, between and after its moves.
/// REQUIRES a non-empty list, in order of time. Cost: O(log n).
struct HeadState {
  double position_mm = 0;
  double speed_mm_s = 0;  ///< signed
  bool standing = true;   ///< outside all moves
};
[[nodiscard]] HeadState HeadAt(std::span<const LineMove> moves, double time_s);

/// End of the last move.
[[nodiscard]] double MotionEnd_s(std::span<const LineMove> moves);

/// The largest speed of all moves, without sign.
[[nodiscard]] double LargestSpeed_mm_s(std::span<const LineMove> moves);

/// Whether the head moves at its largest speed, to within a fraction of it, all the time from..to.
[[nodiscard]] bool IsSteady(std::span<const LineMove> moves, double from_s, double to_s,
                            double tolerance);

/// Whether the head stands at some moment from..to.
[[nodiscard]] bool StandsWithin(std::span<const LineMove> moves, double from_s, double to_s);

/// Frames at the ends of a sweep in which the camera stood still.
struct StillFrames {
  std::size_t first = 0;  ///< leading frames without motion to the next; the last of these is where
                          ///< the sweep begins
  std::size_t last = 0;   ///< trailing frames that repeat the one before them
  bool all = false;       ///< no two frames differ: the camera or the machine hung
};

/// A moving laser crosses new speckle with every frame; a standing one sees the same picture twice.
/// A stretch counts as still only where its frames differ by less than half of what nearly every
/// pair of the remaining frames does, so that a sweep over a smooth bead without speckle loses
/// nothing.
/// @param frames  those of `order` all of one size; no other is looked at.
/// @param order   which frames, as they follow each other; `first` and `last` count in it.
[[nodiscard]] StillFrames FindStillFrames(std::span<const Frame> frames,
                                          std::span<const std::size_t> order);

/// The frames that may be looked at: those with a position of their own, or all where the line
/// gives none. REQUIRES as many positions, if any, as frames.
[[nodiscard]] std::vector<std::size_t> PlacedFrames(const ScanLine& line, std::size_t frame_count);

/// Position of the laser in each frame of a line without frame_positions_mm, mm from the printed
/// start in print direction: the frame `begin` is where scan.line_start_mm was measured.
/// @param frame_count  frames in the sweep, >= 1; line.frame_times_s, where given, has as many.
/// An opposite sweep runs backwards from line_start_mm; where more of it lies on the line if
/// line_start_mm is taken from the line's other end, it is.
[[nodiscard]] std::vector<double> SweepPositions(const Scan& scan, const ScanLine& line,
                                                 std::size_t frame_count, std::size_t begin);

/// Whether the sweep runs against the print: falling positions, or else the opposite direction.
[[nodiscard]] bool SweepsBackwards(const ScanLine& line);

}  // namespace trammel::pressure_advance
