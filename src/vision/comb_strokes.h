// Finds strokes of a comb, and the pencil of equally spaced lines.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "vision/image.h"

namespace trammel::vision {

/// Pencil of image lines, each ax + by + c = 0 with (a, b, c) = first + place * step: the image of
/// equal steps on the plane. `step` is the plane's horizon. Places need not be whole.
struct LinePencil {
  std::array<double, 3> first = {0, -1, 0};  ///< the line of place 0
  std::array<double, 3> step = {0, 0, 1};

  /// Returns y of a place's line at x; infinite or of the wrong sign beyond the horizon.
  [[nodiscard]] double Y_px(double place, double x_px) const;
  /// Returns the place whose line passes through a point.
  [[nodiscard]] double PlaceOf(const PointPx& point) const;
  /// True if the plane between two places and two columns is on one side of the horizon.
  [[nodiscard]] bool Sees(double first_place, double last_place, double left_px,
                          double right_px) const;
};

/// Point on the line of a place.
struct PencilPoint {
  PointPx at;
  double place = 0;
};

/// Fits by algebraic least squares. REQUIRES lines along the rows rather than the columns.
/// @returns nothing if the points are on fewer than three lines or do not determine the pencil.
[[nodiscard]] std::optional<LinePencil> FitPencil(std::span<const PencilPoint> points);

/// Stroke, or a piece of one with a long break.
struct Stroke {
  std::vector<PointPx> points;  ///< centre line, by increasing x
  double width_px = 0;          ///< median
  double height = 0;            ///< median contrast

  [[nodiscard]] double length_px() const { return points.back().x - points.front().x; }
};

/// Picture averaged over narrow strips of columns.
struct Strips {
  cv::Mat means;     ///< float, a column for each strip; NaN where less than most of it was seen
  int width_px = 0;  ///< strip width
};

/// @param contrast  float
/// @param seen      8-bit of the same size: 0 where the picture was not seen.
[[nodiscard]] Strips AverageStrips(const cv::Mat& contrast, const cv::Mat& seen);

/// Links the contrasting features of neighbouring strips: lighter than their surroundings, or
/// darker.
[[nodiscard]] std::vector<Stroke> TraceStrokes(const Strips& strips, bool lighter);

}  // namespace trammel::vision
