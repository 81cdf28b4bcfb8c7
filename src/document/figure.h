// A drawing with its words.
#pragma once

#include <optional>
#include <string>

#include "document/canvas.h"

namespace trammel::report {

inline constexpr double kFigureWidthPx = 760;
/// Of a phone's screen, less the page's margins.
inline constexpr double kNarrowWidthPx = 340;

struct Figure {
  std::string name;     ///< file name without ending, [a-z0-9_-]+
  std::string caption;  ///< how to read it; plain text
  Canvas canvas;
  double png_scale = 2;               ///< px of the PNG per px of the canvas
  std::string seen = {};              ///< what is seen, for those who do not see it; plain text
  std::optional<Canvas> narrow = {};  ///< the same for a phone
};

}  // namespace trammel::report
