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

/// A picture averaged over narrow strips of columns.
struct Strips {
  cv::Mat means;     ///< float, a column for each strip; NaN where less than most of it was seen
  int width_px = 0;  ///< of a strip
};

/// @param contrast  float
/// @param seen      8-bit of the same size: 0 where the picture was not seen.
[[nodiscard]] Strips AverageStrips(const cv::Mat& contrast, const cv::Mat& seen);

/// Links what stands out of each strip from strip to strip: lighter than its surroundings, or
/// darker.
[[nodiscard]] std::vector<Stroke> TraceStrokes(const Strips& strips, bool lighter);

}  // namespace trammel::vision
