#include "vision/homography.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"

namespace trammel::vision {
namespace {

double Cross(const PointPx& a, const PointPx& b, const PointPx& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Twice the smallest triangle of three corners, over the quad's squared size.
double Flatness(const Quad& quad) {
  double smallest = 1e300;
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    smallest = std::min(smallest, std::abs(Cross(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4])));
    longest = std::max(longest, Distance_px(quad[i], quad[(i + 1) % 4]));
  }
  return longest > 0 ? smallest / (longest * longest) : 0;
}

}  // namespace

PointPx Homography::operator()(const PointPx& p) const {
  const double w = m[6] * p.x + m[7] * p.y + m[8];
  return {(m[0] * p.x + m[1] * p.y + m[2]) / w, (m[3] * p.x + m[4] * p.y + m[5]) / w};
}

std::optional<Homography> TargetFromSource(const Quad& target, const Quad& source) {
  constexpr double kFlattest = 1e-6;
  if (!(Flatness(target) > kFlattest) || !(Flatness(source) > kFlattest)) return std::nullopt;
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const PointPx& s = source[static_cast<std::size_t>(i)];
    const PointPx& t = target[static_cast<std::size_t>(i)];
    a.row(2 * i) << s.x, s.y, 1, 0, 0, 0, -s.x * t.x, -s.y * t.x;
    a.row(2 * i + 1) << 0, 0, 0, s.x, s.y, 1, -s.x * t.y, -s.y * t.y;
    b(2 * i) = t.x;
    b(2 * i + 1) = t.y;
  }
  const Eigen::Matrix<double, 8, 1> h = geometry::SolveSquare(a, b);
  if (!h.allFinite()) return std::nullopt;
  Homography homography;
  for (int i = 0; i < 8; ++i) homography.m[static_cast<std::size_t>(i)] = h(i);
  return homography;
}

bool IsConvex(const Quad& quad) {
  int left = 0;
  int right = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = Cross(quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]);
    left += turn > 0;
    right += turn < 0;
  }
  return left == 4 || right == 4;
}

double Area_px2(const Quad& quad) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const PointPx& a = quad[i];
    const PointPx& b = quad[(i + 1) % 4];
    twice += a.x * b.y - b.x * a.y;
  }
  return std::abs(twice) / 2;
}

double Distance_px(const PointPx& a, const PointPx& b) { return std::hypot(a.x - b.x, a.y - b.y); }

}  // namespace trammel::vision
