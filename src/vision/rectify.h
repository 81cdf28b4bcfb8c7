// Looking at a tilted plane straight from above.
#pragma once

#include "base/frame.h"
#include "vision/homography.h"
#include "vision/image.h"

namespace trammel::vision {

/// Resamples a picture bilinearly; what lies outside it repeats its border. Meant for about one
/// pixel to one: shrinking this way aliases.
/// @param photo_from_rectified  where each pixel of the result lies in the photo.
/// REQUIRES 1 <= width, height <= 16384 and a photo of at most 16384 px each way.
[[nodiscard]] Frame Rectify(const BgrView& photo, const Homography& photo_from_rectified,
                            int width_px, int height_px);

/// The same for one channel; what lies outside is 0.
[[nodiscard]] GrayImage Rectify(const GrayImage& image, const Homography& image_from_rectified,
                                int width_px, int height_px);

/// Shrinks by averaging so that neither side is longer than `longest_px` and no more than
/// `most_px` pixels remain; a copy where nothing needs to shrink. REQUIRES a photo of 1 px or more.
/// @param scale  result px per photo px: set by the function.
[[nodiscard]] Frame ShrinkToFit(const BgrView& photo, int longest_px, double most_px,
                                double& scale);

}  // namespace trammel::vision
