// Finds equally spaced parallel strokes in a busy picture, whether or not they are seen whole.
#pragma once

#include <vector>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

struct CombFinderOptions {
  int longest_side_px = 1000;  ///< the search runs on a picture shrunk to this, [200, 4000]
  int fewest_strokes = 5;      ///< [4, 1000]
  double around = 3;           ///< places of plane beyond the outer strokes, [0.5, 10]: the two in
                               ///< which TraceComb looks for a line, and the plate beside it
  double beside = 0.15;        ///< of the strokes' length beyond their ends, [0, 1]
  std::size_t most_found = 8;  ///< best candidates returned
};

/// Strokes on the lines of a pencil, and the piece of the plane that holds them.
struct FoundComb {
  /// Corners of that piece in px of the photo, parts of which may lie outside: the outer two
  /// sides along the strokes lie `around` places beyond the first and the last stroke. First to
  /// second corner and fourth to third run along the strokes; clockwise as seen.
  Quad corners;
  int places = 0;     ///< strokes and the empty places between them
  double around = 0;  ///< places between a stroke and the side next to it
  double weight = 0;  ///< length of the strokes times their contrast, less where irregular
  double beside = 0;  ///< between the strokes' ends and the sides next to them, of the
                      ///< strokes' length
};

/// Turns the picture along the directions in which most edges run, traces strokes in several colour
/// channels, lighter and darker than their surroundings, and keeps those that one pencil of lines
/// explains. Ends of the strokes, bars across them and the picture's border do not matter.
/// @param photo  8-bit BGR. REQUIRES at least 16 px each way.
/// @returns the clearest first, empty where there is none.
[[nodiscard]] std::vector<FoundComb> FindCombs(const BgrView& photo,
                                               const CombFinderOptions& options = {});

}  // namespace trammel::vision
