#include "part_alignment/targets/ellipse_through.h"

#include <array>
#include <cmath>
#include <utility>

namespace trammel::part_alignment {
namespace {

/// Solves the symmetric 5x5 system in place; false where it is singular.
bool Solve5(std::array<std::array<double, 6>, 5>& a) {
  for (int i = 0; i < 5; ++i) {
    int pivot = i;
    for (int k = i + 1; k < 5; ++k) {
      if (std::abs(a[k][i]) > std::abs(a[pivot][i])) pivot = k;
    }
    std::swap(a[i], a[pivot]);
    if (std::abs(a[i][i]) < 1e-9) return false;
    for (int k = 0; k < 5; ++k) {
      if (k == i) continue;
      const double factor = a[k][i] / a[i][i];
      for (int j = i; j < 6; ++j) a[k][j] -= factor * a[i][j];
    }
  }
  for (auto& row : a) row[5] /= row[&row - a.data()];
  return true;
}

}  // namespace

std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale) {
  // a x² + 2 b x y + c y² + d x + e y = 1
  std::array<std::array<double, 6>, 5> system{};
  for (const Offset& point : points) {
    const double x = point.x / scale;
    const double y = point.y / scale;
    const std::array<double, 6> terms{x * x, 2 * x * y, y * y, x, y, 1};
    for (int i = 0; i < 5; ++i) {
      for (int j = i; j < 6; ++j) system[i][j] += terms[i] * terms[j];
    }
  }
  for (int i = 1; i < 5; ++i) {
    for (int j = 0; j < i; ++j) system[i][j] = system[j][i];
  }
  if (!Solve5(system)) return std::nullopt;
  const double a = system[0][5];
  const double b = system[1][5];
  const double c = system[2][5];
  const double det = a * c - b * b;
  if (!(a > 0 && det > 0)) return std::nullopt;
  const double cx = -(c * system[3][5] - b * system[4][5]) / (2 * det);
  const double cy = -(a * system[4][5] - b * system[3][5]) / (2 * det);
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
