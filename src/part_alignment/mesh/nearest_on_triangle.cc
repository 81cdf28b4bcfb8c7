#include "part_alignment/mesh/nearest_on_triangle.h"

#include <array>
#include <limits>

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using enum TriangleFeature;

// Of a triangle without area: the nearest of its edges.
NearestOnTriangle NearestOfEdges(const Vector3d& p, const std::array<Vector3d, 3>& corners) {
  NearestOnTriangle nearest{corners[0], kCorner0};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3d& from = corners[static_cast<std::size_t>(k)];
    const Vector3d along = corners[static_cast<std::size_t>((k + 1) % 3)] - from;
    const double length2 = along.squaredNorm();
    const double share = length2 > 0 ? (p - from).dot(along) / length2 : 0;
    auto feature = static_cast<TriangleFeature>(static_cast<int>(kEdge0) + k);
    if (share <= 0) feature = static_cast<TriangleFeature>(static_cast<int>(kCorner0) + k);
    if (share >= 1)
      feature = static_cast<TriangleFeature>(static_cast<int>(kCorner0) + (k + 1) % 3);
    const Vector3d at =
        share >= 1 ? Vector3d(from + along) : Vector3d(from + std::max(0.0, share) * along);
    const double distance2 = (p - at).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      nearest = {at, feature};
    }
  }
  return nearest;
}

}  // namespace

NearestOnTriangle NearestPoint(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                               const Vector3d& c, bool flat) {
  if (flat) return NearestOfEdges(p, {a, b, c});
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d ap = p - a;
  const double ab_a = ab.dot(ap);
  const double ac_a = ac.dot(ap);
  if (ab_a <= 0 && ac_a <= 0) return {a, kCorner0};
  const Vector3d bp = p - b;
  const double ab_b = ab.dot(bp);
  const double ac_b = ac.dot(bp);
  if (ab_b >= 0 && ac_b <= ab_b) return {b, kCorner1};
  const double of_c = ab_a * ac_b - ab_b * ac_a;
  if (of_c <= 0 && ab_a >= 0 && ab_b <= 0) return {a + ab_a / (ab_a - ab_b) * ab, kEdge0};
  const Vector3d cp = p - c;
  const double ab_c = ab.dot(cp);
  const double ac_c = ac.dot(cp);
  if (ac_c >= 0 && ab_c <= ac_c) return {c, kCorner2};
  const double of_b = ab_c * ac_a - ab_a * ac_c;
  if (of_b <= 0 && ac_a >= 0 && ac_c <= 0) return {a + ac_a / (ac_a - ac_c) * ac, kEdge2};
  const double of_a = ab_b * ac_c - ab_c * ac_b;
  if (of_a <= 0 && ac_b - ab_b >= 0 && ab_c - ac_c >= 0) {
    return {b + (ac_b - ab_b) / (ac_b - ab_b + ab_c - ac_c) * (c - b), kEdge1};
  }
  const double all = of_a + of_b + of_c;
  return {a + of_b / all * ab + of_c / all * ac, kFace};
}

}  // namespace trammel::part_alignment
