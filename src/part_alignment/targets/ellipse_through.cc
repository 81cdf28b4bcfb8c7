#include "part_alignment/targets/ellipse_through.h"

#include <cmath>

#include "part_alignment/targets/small_cholesky.h"

namespace trammel::part_alignment {

void EllipseSums::Add(double x, double y) {
  const double xx = x * x;
  const double xy = x * y;
  const double yy = y * y;
  sums_[kX] += x;
  sums_[kY] += y;
  sums_[kXx] += xx;
  sums_[kXy] += xy;
  sums_[kYy] += yy;
  sums_[kXxx] += x * xx;
  sums_[kXxy] += x * xy;
  sums_[kXyy] += x * yy;
  sums_[kYyy] += y * yy;
  sums_[kXxxx] += xx * xx;
  sums_[kXxxy] += xx * xy;
  sums_[kXxyy] += xx * yy;
  sums_[kXyyy] += xy * yy;
  sums_[kYyyy] += yy * yy;
}

EllipseSums& EllipseSums::operator+=(const EllipseSums& other) {
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += other.sums_[i];
  return *this;
}

std::optional<DiscModel> EllipseSums::Ellipse(double unit_px) const {
  // a x² + 2 b x y + c y² + d x + e y = 1
  const auto& s = sums_;
  SmallMatrix<5> normal{};
  normal[0] = {s[kXxxx]};
  normal[1] = {2 * s[kXxxy], 4 * s[kXxyy]};
  normal[2] = {s[kXxyy], 2 * s[kXyyy], s[kYyyy]};
  normal[3] = {s[kXxx], 2 * s[kXxy], s[kXyy], s[kXx]};
  normal[4] = {s[kXxy], 2 * s[kXyy], s[kYyy], s[kXy], s[kYy]};
  if (!Factor(normal)) return std::nullopt;
  const auto [a, b, c, d, e] = SolveFactored<5>(normal, {s[kXx], 2 * s[kXy], s[kYy], s[kX], s[kY]});
  const double det = a * c - b * b;
  if (!(a > 0 && det > 0)) return std::nullopt;
  const double cx = -(c * d - b * e) / (2 * det);
  const double cy = -(a * e - b * d) / (2 * det);
  const double level = 1 + a * cx * cx + 2 * b * cx * cy + c * cy * cy;
  // W is the square root of the form: (A + sqrt(det) I) / sqrt(trace + 2 sqrt(det)).
  const double root = std::sqrt(det);
  const double norm = std::sqrt((a + c + 2 * root) * level) * unit_px;
  DiscModel disc;
  disc.column_px = cx * unit_px;
  disc.row_px = cy * unit_px;
  disc.wxx = (a + root) / norm;
  disc.wxy = b / norm;
  disc.wyy = (c + root) / norm;
  return disc;
}

std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale) {
  EllipseSums sums;
  for (const Offset& point : points) sums.Add(point.x / scale, point.y / scale);
  return sums.Ellipse(scale);
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
