#include "part_alignment/targets/ellipse_through.h"

#include <cmath>

namespace trammel::part_alignment {

std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale) {
  EllipseSumsOf<double> sums;
  for (const Offset& point : points) sums.Add(point.x / scale, point.y / scale);
  const EllipsesOf<double> ellipse = sums.Ellipses(scale);
  if (!ellipse.are) return std::nullopt;
  return ModelOf(ellipse);
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
