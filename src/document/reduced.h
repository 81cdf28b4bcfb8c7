// Pictures with fewer pixels.
#pragma once

#include "base/frame.h"

namespace trammel::report {

/// Reduces a picture to a size in px, rounded, each pixel the mean of those that it covers; a side
/// that is shorter than asked for stays as it is. REQUIRES a picture that is not empty.
[[nodiscard]] Frame Reduced(const BgrView& image, double most_width, double most_height);

}  // namespace trammel::report
