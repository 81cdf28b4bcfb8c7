// Drawing with its texts.
#pragma once

#include <optional>
#include <string>

#include "document/canvas.h"

namespace trammel::report {

inline constexpr double kFigureWidthPx = 760;
/// Width of a phone's screen without the page's margins.
inline constexpr double kNarrowWidthPx = 340;

struct Figure {
  std::string name;     ///< file name without ending, [a-z0-9_-]+
  std::string caption;  ///< explanation; plain text
  Canvas canvas;
  double png_scale = 2;               ///< px of the PNG per px of the canvas
  std::string seen = {};              ///< alternative text for screen readers; plain text
  std::optional<Canvas> narrow = {};  ///< the same for a phone
};

}  // namespace trammel::report
