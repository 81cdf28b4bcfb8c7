#include "part_alignment/targets/square_centre.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trammel::part_alignment {
namespace {

/// The edges' lines, each moved out by so much in its middle and at its end.
using Shifts = std::array<std::array<double, 2>, 4>;

std::array<ImagePoint, 4> Corners(const std::array<EdgeFit, 4>& edges, const Shifts& shifts) {
  struct Line {
    ImagePoint at;
    ImagePoint along;
  };
  std::array<Line, 4> lines;
  for (std::size_t k = 0; k < 4; ++k) {
    const EdgeFit& e = edges[k];
    const ImagePoint& n = e.outwards;
    const double slope = shifts[k][1] / e.half_length_px;
    lines[k] = {{e.middle.x + shifts[k][0] * n.x, e.middle.y + shifts[k][0] * n.y},
                {-n.y + slope * n.x, n.x + slope * n.y}};
  }
  std::array<ImagePoint, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Line& a = lines[(k + 3) % 4];
    const Line& b = lines[k];
    const double sine = a.along.x * b.along.y - a.along.y * b.along.x;
    const double t = ((b.at.x - a.at.x) * b.along.y - (b.at.y - a.at.y) * b.along.x) / sine;
    corners[k] = {a.at.x + t * a.along.x, a.at.y + t * a.along.y};
  }
  return corners;
}

}  // namespace

SquareCentre CentreOf(const std::array<EdgeFit, 4>& edges) {
  SquareCentre result;
  result.corners = Corners(edges, {});
  result.centre = CrossingOfDiagonals(result.corners);
  constexpr double kStep_px = 1e-3;
  double var_column = 0;
  double var_row = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<ImagePoint, 2> by{};  // d centre / d shift
    for (std::size_t i = 0; i < 2; ++i) {
      Shifts ahead{};
      Shifts behind{};
      ahead[k][i] = kStep_px;
      behind[k][i] = -kStep_px;
      const ImagePoint a = CrossingOfDiagonals(Corners(edges, ahead));
      const ImagePoint b = CrossingOfDiagonals(Corners(edges, behind));
      by[i] = {(a.x - b.x) / (2 * kStep_px), (a.y - b.y) / (2 * kStep_px)};
    }
    const EdgeFit& e = edges[k];
    const auto variance = [&e](double middle, double end) {
      return middle * middle * e.var_middle + 2 * middle * end * e.covariance +
             end * end * e.var_end;
    };
    var_column += variance(by[0].x, by[1].x);
    var_row += variance(by[0].y, by[1].y);
  }
  double scatter = 0;
  int scatter_free = 0;
  for (const EdgeFit& edge : edges) {
    scatter += edge.scatter;
    scatter_free += edge.scatter_free;
  }
  result.unevenness = std::sqrt(std::max(1.0, scatter / std::max(1, scatter_free)));
  result.sigma_column_px = result.unevenness * std::sqrt(var_column);
  result.sigma_row_px = result.unevenness * std::sqrt(var_row);
  return result;
}

}  // namespace trammel::part_alignment
