// Published decomposition of a tap into straight lines: the corners, and the lines.
#pragma once

#include <cstddef>

#include "tap/samples/corruption.h"
#include "tap/samples/line_fit.h"
#include "tap/samples/motion.h"

namespace trammel::tap {

/// Lines of a tap and their crossings. Times count from CleanTap::origin_s, forces from
/// CleanTap::origin_g.
struct TapLines {
  double press_sign = 1;       ///< sign of the press force
  bool has_collision = false;  ///< Approach, compression and dwell below were found.
  bool has_break = false;      ///< Decompression and departure were.
  bool is_split = false;       ///< Decompression is two lines.
  /// Distance of the decompression's nearer end from its middle, in deviations of the noise; from
  /// kSplitNoise on it is split.
  double split_reach = 0;

  // First samples of the stretches.
  std::size_t approach_first = 0;
  std::size_t collision = 0;
  std::size_t dwell_first = 0;
  std::size_t pull_back = 0;  ///< The end of the dwell.
  std::size_t decompression_first = 0;
  std::size_t split_at = 0;
  std::size_t break_at = 0;
  std::size_t departure_end = 0;

  LineFit approach;
  LineFit compression;
  LineFit dwell;
  LineFit upper;          ///< First half of a split decompression, else the whole.
  LineFit decompression;  ///< The half that ends in the break, or the whole.
  LineFit whole;          ///< One line through all of the decompression.
  LineFit departure;

  Crossing touch;      ///< Approach and compression.
  Crossing press_end;  ///< Compression and dwell.
  Crossing dwell_end;  ///< Dwell and upper.
  Crossing split;      ///< Upper and decompression, where it is split.
  Crossing let_go;     ///< Decompression and departure: the break.
};

/// Limit of the write-up; published code uses 3.
inline constexpr double kSplitNoise = 2;

/// Finds the lines. Cost: O(samples), 3 us for 400; no memory.
[[nodiscard]] TapLines FindTapLines(const CleanTap& clean, const TapMotion& motion);

}  // namespace trammel::tap
