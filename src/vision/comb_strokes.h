// Strokes of filament that run along the rows of a picture.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "vision/image.h"

namespace trammel::vision {

/// One stroke, or a piece of one that is broken for long.
struct Stroke {
  std::vector<PointPx> points;  ///< its middle, by increasing x
  double width_px = 0;          ///< median
  double height = 0;            ///< median contrast

  [[nodiscard]] double length_px() const { return points.back().x - points.front().x; }
};

/// Averages a picture over narrow strips of columns, and links what stands out of each strip from
/// strip to strip.
/// @param contrast  float, filament above 0.
/// @param seen      8-bit of the same size: 0 where the picture was not seen.
[[nodiscard]] std::vector<Stroke> TraceStrokes(const cv::Mat& contrast, const cv::Mat& seen);

}  // namespace trammel::vision
