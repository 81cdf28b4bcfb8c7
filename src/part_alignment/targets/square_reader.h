// The modules of a square marker: which are white, or why that cannot be told.
#pragma once

#include <array>
#include <cstdint>

#include "base/page.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

/// The picture of the plane of a square of 7 x 7 modules: module coordinates (u, v) in 0 … 7, v
/// downwards where the corners are in SquareShape's order.
class SquarePlane {
 public:
  /// REQUIRES four corners of a convex quadrangle, in its order.
  explicit SquarePlane(const std::array<ImagePoint, 4>& corners);
  [[nodiscard]] ImagePoint At(double u, double v) const;

 private:
  double a_, b_, c_, d_, e_, f_, g_, h_;
};

enum class SquareState {
  kClear,    ///< every module is one of two shades, and the border is black
  kNone,     ///< no marker: no black border on white, or next to nothing within
  kUnclear,  ///< a marker, parts of which are covered
  kCutOff,   ///< the white about it is beyond the picture's border
};

struct SquareModules {
  SquareState state = SquareState::kNone;
  /// As in square_code.h, upright where the first corner is the upper left one; with kClear.
  std::uint32_t word = 0;
  double bright = 0;   ///< of the white about the marker, grey levels in its middle
  double dark = 0;     ///< of its border
  double light_x = 0;  ///< change of brightness by place, 1/px, relative to that of its middle
  double light_y = 0;
};

/// @param corners  clockwise in the picture, right to about a pixel
/// @param min_contrast  grey levels, between border and surroundings
[[nodiscard]] SquareModules ReadSquareModules(const PageView& picture,
                                              const std::array<ImagePoint, 4>& corners,
                                              double min_contrast);

}  // namespace trammel::part_alignment
