// Finds strokes of a comb, and the pencil that equally spaced lines form.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "vision/image.h"

namespace trammel::vision {

/// A pencil of image lines, each ax + by + c = 0 with (a, b, c) = first + place * step: what equal
/// steps on the plane become in a picture. `step` is the plane's horizon. Places need not be whole.
struct LinePencil {
  std::array<double, 3> first = {0, -1, 0};  ///< the line of place 0, b = -1
  std::array<double, 3> step = {0, 0, 1};

  /// y of a place's line at x; infinite or of the wrong sign beyond the horizon.
  [[nodiscard]] double Y_px(double place, double x_px) const;
  /// The place whose line goes through a point.
  [[nodiscard]] double PlaceOf(const PointPx& point) const;
  /// Whether the plane between two places and two columns lies on one side of the horizon.
  [[nodiscard]] bool Sees(double first_place, double last_place, double left_px,
                          double right_px) const;
};

/// A point on the line of a place.
struct PencilPoint {
  PointPx at;
  double place = 0;
};

/// Algebraic least squares. REQUIRES lines that run along the rows rather than the columns.
/// @returns nothing where the points lie on fewer than three lines or do not settle the pencil.
[[nodiscard]] std::optional<LinePencil> FitPencil(std::span<const PencilPoint> points);

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
