// What all readers of photos share: the bounds of a size, and the turn that EXIF asks for.
#pragma once

#include <cstddef>

#include "base/frame.h"
#include "base/result.h"
#include "machine/camera/image_file.h"

namespace trammel::machine {

/// Refuses a size above the options'.
[[nodiscard]] Result<void> CheckPixels(int width_px, int height_px,
                                       const ImageReadOptions& options);

/// Refuses a size that a photo in so few bytes does not have: a thousand pixels in a byte is ten
/// times what the emptiest wall takes, and a bomb's sign.
[[nodiscard]] Result<void> CheckPacking(int width_px, int height_px, std::size_t bytes);

/// Shows the stored picture as EXIF's orientation, 1 … 8, asks for.
[[nodiscard]] Frame TurnedByExif(Frame frame, int orientation);

/// Side lengths by which a picture is reduced: 1, 2, 4 or 8, so that about enough pixels remain.
[[nodiscard]] int ReductionOf(int width_px, int height_px, const ImageReadOptions& options);

}  // namespace trammel::machine
