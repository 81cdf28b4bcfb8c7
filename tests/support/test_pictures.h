// Small pictures for tests of cameras.
#pragma once

#include <string>

#include "base/frame.h"

namespace trammel::test {

/// The bytes of the frame as a JPEG. @param quality 1 … 100.
[[nodiscard]] std::string JpegOf(const Frame& frame, int quality = 90);

/// A picture with structure; `phase` shifts it.
[[nodiscard]] Frame TestPicture(int width, int height, int phase);

}  // namespace trammel::test
