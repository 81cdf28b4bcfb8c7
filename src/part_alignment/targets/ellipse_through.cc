#include "part_alignment/targets/ellipse_through.h"

#include <cmath>

#include "part_alignment/targets/small_cholesky.h"

namespace trammel::part_alignment {

std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale) {
  // a x² + 2 b x y + c y² + d x + e y = 1
  SmallMatrix<5> normal = SmallMatrix<5>::Zero();
  SmallVector<5> right = SmallVector<5>::Zero();
  for (const Offset& point : points) {
    const double x = point.x / scale;
    const double y = point.y / scale;
    const SmallVector<5> row(x * x, 2 * x * y, y * y, x, y);
    normal += row * row.transpose();
    right += row;
  }
  const auto factor = Factored<5>(normal);
  if (!factor) return std::nullopt;
  const SmallVector<5> conic = factor->solve(right);
  const double a = conic[0], b = conic[1], c = conic[2], d = conic[3], e = conic[4];
  const double det = a * c - b * b;
  if (!(a > 0 && det > 0)) return std::nullopt;
  const double cx = -(c * d - b * e) / (2 * det);
  const double cy = -(a * e - b * d) / (2 * det);
  const double level = 1 + a * cx * cx + 2 * b * cx * cy + c * cy * cy;
  // W is the square root of the form: (A + sqrt(det) I) / sqrt(trace + 2 sqrt(det)).
  const double root = std::sqrt(det);
  const double norm = std::sqrt((a + c + 2 * root) * level) * scale;
  DiscModel disc;
  disc.column_px = cx * scale;
  disc.row_px = cy * scale;
  disc.wxx = (a + root) / norm;
  disc.wxy = b / norm;
  disc.wyy = (c + root) / norm;
  return disc;
}

double DistanceFrom(const DiscModel& disc, std::span<const Offset> points) {
  double sum = 0;
  for (const Offset& point : points) {
    const double x = point.x - disc.column_px;
    const double y = point.y - disc.row_px;
    const double u = disc.wxx * x + disc.wxy * y;
    const double v = disc.wxy * x + disc.wyy * y;
    const double off = std::sqrt(u * u + v * v) - 1;
    sum += off * off;
  }
  return std::sqrt(sum / static_cast<double>(points.size())) * MeanRadius(disc);
}

}  // namespace trammel::part_alignment
