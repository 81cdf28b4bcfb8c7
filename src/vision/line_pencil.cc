#include "vision/line_pencil.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <set>

#include "geometry/linear_systems.h"

namespace trammel::vision {

double LinePencil::Y_px(double place, double x_px) const {
  const double a = first[0] + place * step[0];
  const double b = first[1] + place * step[1];
  const double c = first[2] + place * step[2];
  return -(a * x_px + c) / b;
}

double LinePencil::PlaceOf(const PointPx& point) const {
  const auto at = [&](const std::array<double, 3>& line) {
    return line[0] * point.x + line[1] * point.y + line[2];
  };
  return -at(first) / at(step);
}

bool LinePencil::Sees(double first_place, double last_place, double left_px,
                      double right_px) const {
  double sign = 0;
  for (const double x : {left_px, right_px}) {
    for (const double place : {first_place, last_place}) {
      if (!(first[1] + place * step[1] < 0)) return false;
      const double y = Y_px(place, x);
      const double side = step[0] * x + step[1] * y + step[2];
      if (sign * side < 0 || side == 0) return false;
      sign = side;
    }
  }
  return true;
}

std::optional<LinePencil> FitPencil(std::span<const PencilPoint> points) {
  std::set<double> places;
  double x0 = 0, y0 = 0, size = 1;
  for (const PencilPoint& point : points) {
    places.insert(point.place);
    x0 += point.at.x / static_cast<double>(points.size());
    y0 += point.at.y / static_cast<double>(points.size());
  }
  if (places.size() < 3) return std::nullopt;
  for (const PencilPoint& point : points) {
    size = std::max({size, std::abs(point.at.x - x0), std::abs(point.at.y - y0)});
  }
  const double middle = (*places.begin() + *places.rbegin()) / 2;
  const double span = (*places.rbegin() - *places.begin()) / 2;
  // (a1 + k b1) x + a3 + k b3 + k y b2 = y, with x, y and k scaled to about -1 … 1.
  Eigen::MatrixXd a(static_cast<Eigen::Index>(points.size()), 5);
  Eigen::VectorXd b(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = (points[i].at.x - x0) / size, y = (points[i].at.y - y0) / size;
    const double k = (points[i].place - middle) / span;
    a.row(static_cast<Eigen::Index>(i)) << x, 1, k * x, k, k * y;
    b(static_cast<Eigen::Index>(i)) = y;
  }
  const auto solution = geometry::SolveOfFullRank(a, b);
  if (!solution) return std::nullopt;
  const Eigen::VectorXd& c = *solution;
  // Back to pixels: line (u, v, w) in scaled coordinates is (u, v, size w - u x0 - v y0).
  const auto unscaled = [&](double u, double v, double w) {
    return std::array<double, 3>{u, v, size * w - u * x0 - v * y0};
  };
  const std::array<double, 3> centre = unscaled(c(0), -1, c(1));
  const std::array<double, 3> per_span = unscaled(c(2), c(4), c(3));
  LinePencil pencil;
  for (std::size_t i = 0; i < 3; ++i) {
    pencil.step[i] = per_span[i] / span;
    pencil.first[i] = centre[i] - middle * pencil.step[i];
  }
  const double scale = -pencil.first[1];
  if (!(scale > 1e-9)) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) {
    pencil.first[i] /= scale;
    pencil.step[i] /= scale;
  }
  return pencil;
}

}  // namespace trammel::vision
