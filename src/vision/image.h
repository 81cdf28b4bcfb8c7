// Holds float images and plane geometry of a picture.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "base/check.h"
#include "base/frame.h"

namespace trammel::vision {

/// A point of a picture; (0, 0) is the centre of the first pixel, x right, y down.
struct PointPx {
  double x = 0;
  double y = 0;
};

/// Four corners in order along the outline.
using Quad = std::array<PointPx, 4>;

/// One brightness per pixel, shape (height, width), row-major.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::vector<float> value;

  GrayImage() = default;
  GrayImage(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        value(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {
    TRAMMEL_CHECK(width_px >= 0 && height_px >= 0, "{} x {}", width_px, height_px);
  }

  [[nodiscard]] const float* row(int y) const {
    return value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
  [[nodiscard]] float* row(int y) {
    return value.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};

/// Row-major 3 x 3 matrix, up to scale.
struct Homography {
  std::array<double, 9> m = {1, 0, 0, 0, 1, 0, 0, 0, 1};

  [[nodiscard]] PointPx operator()(const PointPx& point) const;
};

/// The map that takes the four corners of `source` to those of `target`, exactly.
/// @returns nothing where three corners of either lie on one line.
[[nodiscard]] std::optional<Homography> TargetFromSource(const Quad& target, const Quad& source);

/// Whether the four corners, in their order, go round a convex area.
[[nodiscard]] bool IsConvex(const Quad& quad);

/// Without sign, in px^2.
[[nodiscard]] double Area_px2(const Quad& quad);

[[nodiscard]] double Distance_px(const PointPx& a, const PointPx& b);

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
