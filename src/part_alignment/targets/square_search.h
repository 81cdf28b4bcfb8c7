// Where a picture might show a square: outlines of dark things, and four lines along them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

struct SquareRules {
  double min_side_px = 0;  ///< of the shorter sides
  double max_side_px = 0;  ///< of the longer ones
  int min_contrast = 0;    ///< grey levels
};

/// A dark thing with a closed outline.
struct DarkOutline {
  enum class Kind {
    kQuad,    ///< of four straight sides
    kOther,   ///< compact, with bright spots within, but not of four straight sides
    kCutOff,  ///< the same at the picture's border
  };
  Kind kind = Kind::kOther;
  /// With kQuad: clockwise in the picture, right to about a pixel. Else: of the upright box.
  std::array<ImagePoint, 4> corners{};
};

/// Memory of a search, to be used again.
struct OutlineWorkspace {
  std::vector<std::uint8_t> traced;
  std::vector<std::int16_t> outline;  ///< x, y of pixel corners, by turns
};

/// Every few rows, edges with enough contrast; from each, the outline of what is darker than half
/// way is followed, once for each level of light. The same thing may come several times.
/// REQUIRES 1 channel, 16 … 32,767 px a side.
[[nodiscard]] std::vector<DarkOutline> FindDarkOutlines(const PageView& picture,
                                                        const SquareRules& rules,
                                                        OutlineWorkspace& workspace);

}  // namespace trammel::part_alignment
