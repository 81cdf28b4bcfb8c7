// Where a picture might show a disc: runs across rows, then the outline by rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

/// A stretch of a row between two edges of opposite sign, with some contrast on both sides.
struct Run {
  int row = 0;
  int first = 0;  ///< column of the edge
  int last = 0;
  int inside = 0;   ///< grey level
  int outside = 0;  ///< the mean of both sides
  int nearer = 0;   ///< the side that is nearer to the inside
};

/// Calls `visit` for each run of `row` with a length in [min_px, max_px]. `edges` is memory.
/// REQUIRES 1 channel and a width of at least 16.
struct RunRules {
  int min_px = 0;
  int max_px = 0;
  int min_contrast = 0;
  int edge_step = 0;  ///< least |I(x + 1) - I(x - 1)| of an edge
};
void RunsOfRow(const PageView& picture, int row, const RunRules& rules,
               std::vector<std::int32_t>& edges, std::vector<Run>& runs);

/// Walks from the run's middle to the middle of what has its shade: the centre by chords, (column,
/// row), and the ellipse that chords in four directions are of. Absent where they are of none, or
/// of one that is smaller than a disc of `min_radius_px` or tilted by more than some 73 degrees.
struct Middle {
  double column_px = 0;
  double row_px = 0;
  /// From the unit circle to the ellipse, symmetric: (xx, xy; xy, yy), px.
  double xx = 0;
  double xy = 0;
  double yy = 0;
};
[[nodiscard]] std::optional<Middle> WalkToMiddle(const PageView& picture, const Run& run,
                                                 double min_radius_px, double max_radius_px);

/// The ellipse through where rays from the middle cross half the contrast, as a start for FitDisc.
/// Absent where they do not lie on one, or the contrast is less.
/// @param dark  whether the disc is darker than what is about it.
[[nodiscard]] std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle,
                                                 bool dark, double min_contrast);

struct Offset {
  double x = 0;
  double y = 0;
};

/// The ellipse (centre and shape of a model) nearest to points about (0, 0), by the conic's
/// algebraic residual; `scale`: about how far from (0, 0) they are. Absent where it is no ellipse.
[[nodiscard]] std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale);

/// Grey value between pixels. REQUIRES 0 <= x <= width - 1 and the same for y.
[[nodiscard]] inline double Between(const PageView& picture, double x, double y) {
  const int x0 = std::min(static_cast<int>(x), picture.width - 2);
  const int y0 = std::min(static_cast<int>(y), picture.height - 2);
  const double fx = x - x0;
  const double fy = y - y0;
  const std::uint8_t* p = picture.row(y0) + x0;
  const std::uint8_t* below = p + picture.stride;
  const double above_grey = p[0] + (p[1] - p[0]) * fx;
  const double below_grey = below[0] + (below[1] - below[0]) * fx;
  return above_grey + (below_grey - above_grey) * fy;
}

/// Directions at even steps of the angle, each from the one before: right to 1e-13.
class Directions {
 public:
  Directions(double first_rad, double step_rad)
      : x_(std::cos(first_rad)),
        y_(std::sin(first_rad)),
        cos_(std::cos(step_rad)),
        sin_(std::sin(step_rad)) {}
  [[nodiscard]] double x() const { return x_; }
  [[nodiscard]] double y() const { return y_; }
  void Next() {
    const double x = x_ * cos_ - y_ * sin_;
    y_ = x_ * sin_ + y_ * cos_;
    x_ = x;
  }

 private:
  double x_;
  double y_;
  double cos_;
  double sin_;
};

}  // namespace trammel::part_alignment
