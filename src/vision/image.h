// Float images and plane geometry of a picture.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "base/check.h"
#include "base/frame.h"

namespace trammel::vision {

/// Point of a picture; (0, 0) is the centre of the first pixel, x right, y down.
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

/// Returns the homography that maps by `b` first, then by `a`.
[[nodiscard]] Homography Product(const Homography& a, const Homography& b);

/// Returns the homography that maps the four corners of `source` exactly to those of `target`.
/// @returns nothing if three corners of either are collinear.
[[nodiscard]] std::optional<Homography> TargetFromSource(const Quad& target, const Quad& source);

/// True if the four corners, in their order, enclose a convex area.
[[nodiscard]] bool IsConvex(const Quad& quad);

/// Computes the unsigned area, in px^2.
[[nodiscard]] double Area_px2(const Quad& quad);

[[nodiscard]] double Distance_px(const PointPx& a, const PointPx& b);

/// Resamples a picture bilinearly; outside of it the border is repeated. Meant for a scale of about
/// 1: reduction aliases.
/// @param photo_from_rectified  maps each pixel of the result to the photo.
/// REQUIRES 1 <= width, height <= 16384 and a photo of at most 16384 px each way.
[[nodiscard]] Frame Rectify(const BgrView& photo, const Homography& photo_from_rectified,
                            int width_px, int height_px);

/// Does the same for one channel; 0 outside.
[[nodiscard]] GrayImage Rectify(const GrayImage& image, const Homography& image_from_rectified,
                                int width_px, int height_px);

/// Reduces by averaging so that neither side is longer than `longest_px` and at most `most_px`
/// pixels remain; a copy if nothing needs reduction. REQUIRES a photo of 1 px or more.
/// @param scale  result px per photo px: output.
[[nodiscard]] Frame ShrinkToFit(const BgrView& photo, int longest_px, double max_px, double& scale);

}  // namespace trammel::vision
