// Finds equally spaced parallel strokes in a busy picture, even if partly hidden.
#pragma once

#include <cstddef>
#include <vector>

#include "base/frame.h"
#include "vision/comb_strokes.h"
#include "vision/image.h"

namespace trammel::vision {

/// Places of plane beyond the outer strokes that are looked at: the two in which TraceComb looks
/// for a line, and the plate beside it.
inline constexpr double kAroundComb = 3;
/// Margin beyond the strokes' ends, as a part of their length.
inline constexpr double kBesideComb = 0.15;

/// Maximum number of combs: frame, labels and texture are combs as well, some of them clearer than
/// a pattern.
inline constexpr std::size_t kMostCombs = 40;

/// Strokes on the lines of a pencil, and the part of the plane that contains them.
struct FoundComb {
  /// Corners of that piece in px of the photo, parts of which may lie outside: the outer two
  /// sides along the strokes lie kAroundComb places beyond the first and the last stroke. First to
  /// second corner and fourth to third run along the strokes; clockwise as seen.
  Quad corners;
  int places = 0;     ///< strokes and the empty places between them
  double weight = 0;  ///< length of the strokes times their contrast, less where irregular
  LinePencil pencil;  ///< the strokes' lines in px of the photo; place 0 is the first stroke
};

/// Turns the picture along the directions in which most edges run, traces strokes in several colour
/// channels, lighter and darker than their surroundings, and keeps those that one pencil of lines
/// explains. Ends of the strokes, bars across them and the picture's border do not matter.
/// @param photo  8-bit BGR. REQUIRES at least 16 px each way.
/// @returns up to kMostCombs, the clearest first; empty where there is none.
[[nodiscard]] std::vector<FoundComb> FindCombs(const BgrView& photo);

}  // namespace trammel::vision
