// How rectangles of pixels lie to each other.
#pragma once

#include "base/frame.h"

namespace trammel {

/// Whether all of `inner` lies within `outer`.
[[nodiscard]] inline bool Contains(const PixelRect& outer, const PixelRect& inner) {
  return inner.x >= outer.x && inner.y >= outer.y &&
         inner.x + inner.width <= outer.x + outer.width &&
         inner.y + inner.height <= outer.y + outer.height;
}

}  // namespace trammel
