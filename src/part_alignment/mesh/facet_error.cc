#include "part_alignment/mesh/facet_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

double HeightOver(const MeshDistance& mesh, std::uint32_t triangle, double edge_mm) {
  return AreaVector(mesh.mesh(), mesh.mesh().triangles[triangle]).norm() / edge_mm;
}

// Computes the bend across the edge from corner k to the next, above 0 where the solid is convex; 0
// at a rim.
double EdgeBend_rad(const MeshDistance& mesh, std::uint32_t triangle, int corner) {
  const auto k = static_cast<std::size_t>(corner);
  const std::uint32_t other = mesh.NeighboursOf(triangle)[k];
  if (other == kNoTriangle) return 0;
  const Vector3d a = mesh.FaceNormal(triangle);
  const Vector3d b = mesh.FaceNormal(other);
  const double bend = std::atan2(a.cross(b).norm(), a.dot(b));
  const Triangle& corners = mesh.mesh().triangles[triangle];
  const Vector3d along =
      mesh.mesh().vertices_mm[corners[(k + 1) % 3]] - mesh.mesh().vertices_mm[corners[k]];
  return a.cross(b).dot(along) < 0 ? -bend : bend;
}

struct Bends {
  std::array<double, 3> middle_mm{};  // quadratic surface above the middles of the edges
  FacetError error;
};

Bends BendsOf(const MeshDistance& mesh, std::uint32_t triangle) {
  Bends bends;
  if (mesh.IsSliver(triangle)) return bends;
  const Triangle& corners = mesh.mesh().triangles[triangle];
  std::array<double, 3> lift{};  // bend times height
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double bend = EdgeBend_rad(mesh, triangle, k);
    const std::uint32_t other = mesh.NeighboursOf(triangle)[at];
    if (other == kNoTriangle || std::abs(bend) > kCrease_rad || mesh.IsSliver(other)) continue;
    const double edge_mm =
        (mesh.mesh().vertices_mm[corners[(at + 1) % 3]] - mesh.mesh().vertices_mm[corners[at]])
            .norm();
    const double own_mm = HeightOver(mesh, triangle, edge_mm);
    // A flat face beside a round of narrow strips is bent no more than the strips.
    const double height_mm = std::min(own_mm, HeightOver(mesh, other, edge_mm));
    lift[at] = bend * height_mm;
    bends.error.tilt_rad = std::max(bends.error.tilt_rad, std::abs(bend) / 2 * height_mm / own_mm);
  }
  const double all = lift[0] + lift[1] + lift[2];
  for (std::size_t k = 0; k < 3; ++k) bends.middle_mm[k] = (all - lift[k]) / 8;
  if (!mesh.mesh().lifts.empty()) {
    const TriangleLift& known = mesh.mesh().lifts[triangle];
    for (std::size_t k = 0; k < 3; ++k)
      bends.middle_mm[k] = static_cast<double>(known.middle_mm[k]);
    bends.error.left_mm = static_cast<double>(known.left_mm);
  }
  const double middle_mm = 4.0 / 9 * (bends.middle_mm[0] + bends.middle_mm[1] + bends.middle_mm[2]);
  for (const double mm : {middle_mm, bends.middle_mm[0], bends.middle_mm[1], bends.middle_mm[2]}) {
    bends.error.outward_mm = std::max(bends.error.outward_mm, mm);
    bends.error.inward_mm = std::max(bends.error.inward_mm, -mm);
  }
  return bends;
}

std::size_t CornerAt(const Triangle& triangle, std::uint32_t vertex) {
  return triangle[0] == vertex ? 0 : triangle[1] == vertex ? 1 : 2;
}

}  // namespace

FacetError FacetErrorOf(const MeshDistance& mesh, std::uint32_t triangle) {
  return BendsOf(mesh, triangle).error;
}

namespace {

/// Quadratic surface over a triangle and beyond its edges.
struct SmoothLift {
  double mm = 0;      ///< above 0 outside the triangle
  Vector3d gradient;  ///< lift's gradient, along the triangle
};

struct LiftedTriangle {
  std::array<double, 3> middle_mm{};
  std::array<Vector3d, 3> from_mm;   // a place where share k is 0
  std::array<Vector3d, 3> by_place;  // gradient of the shares

  [[nodiscard]] double Share(std::size_t k, const Vector3d& at) const {
    return by_place[k].dot(at - from_mm[k]);
  }
  [[nodiscard]] SmoothLift At(const std::array<double, 3>& share) const {
    SmoothLift lift{0, Vector3d::Zero()};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      lift.mm += 4 * share[k] * share[next] * middle_mm[k];
      lift.gradient += 4 * middle_mm[k] * (share[k] * by_place[next] + share[next] * by_place[k]);
    }
    return lift;
  }
};

std::optional<LiftedTriangle> Lifted(const MeshDistance& mesh, std::uint32_t triangle) {
  const Bends bends = BendsOf(mesh, triangle);
  if (!(bends.error.either_mm() > 0)) return std::nullopt;
  LiftedTriangle lifted;
  lifted.middle_mm = bends.middle_mm;
  const Triangle& corners = mesh.mesh().triangles[triangle];
  const Vector3d area = AreaVector(mesh.mesh(), corners);
  for (std::size_t k = 0; k < 3; ++k) {
    lifted.from_mm[k] = mesh.mesh().vertices_mm[corners[(k + 1) % 3]];
    const Vector3d opposite = mesh.mesh().vertices_mm[corners[(k + 2) % 3]] - lifted.from_mm[k];
    lifted.by_place[k] = area.cross(opposite) / area.squaredNorm();
  }
  return lifted;
}

// Finds the edge that contains a point of the triangle, by its first corner; none for an interior
// point.
std::optional<int> EdgeUnder(const MeshDistance& mesh, std::uint32_t triangle, const Vector3d& at) {
  const Triangle& corners = mesh.mesh().triangles[triangle];
  std::optional<int> edge;
  double sharpest = -1;
  for (int k = 0; k < 3; ++k) {
    const auto first = static_cast<std::size_t>(k);
    const Vector3d& from = mesh.mesh().vertices_mm[corners[first]];
    const Vector3d along = mesh.mesh().vertices_mm[corners[(first + 1) % 3]] - from;
    constexpr double kOnEdge_mm = 1e-9;
    const double inward_mm = mesh.FaceNormal(triangle).cross(along.normalized()).dot(at - from);
    const double bend = std::abs(EdgeBend_rad(mesh, triangle, k));
    if (inward_mm > kOnEdge_mm || bend <= sharpest) continue;
    sharpest = bend;
    edge = k;
  }
  return edge;
}

// True if `at` is a corner of the triangle where a sharp edge ends, or at a rim.
bool OverSharpVertex(const MeshDistance& mesh, std::uint32_t triangle, const Vector3d& at) {
  const std::vector<Triangle>& triangles = mesh.mesh().triangles;
  for (const std::uint32_t vertex : triangles[triangle]) {
    constexpr double kThere_mm = 1e-9;
    if ((mesh.mesh().vertices_mm[vertex] - at).norm() > kThere_mm) continue;
    std::uint32_t t = triangle;
    constexpr int kMaxFaces = 1000;
    for (int i = 0; i < kMaxFaces; ++i) {
      const std::size_t k = CornerAt(triangles[t], vertex);
      if (std::abs(EdgeBend_rad(mesh, t, static_cast<int>(k))) >= kCrease_rad) return true;
      t = mesh.NeighboursOf(t)[k];
      if (t == kNoTriangle) return true;
      if (t == triangle) return false;
    }
    return true;
  }
  return false;
}

SmoothLift SmoothLiftAt(const MeshDistance& mesh, std::uint32_t triangle, const Vector3d& at) {
  const auto lifted = Lifted(mesh, triangle);
  if (!lifted) return {0, Vector3d::Zero()};
  std::array<double, 3> share{};
  for (std::size_t k = 0; k < 3; ++k) share[k] = std::clamp(lifted->Share(k, at), 0.0, 1.0);
  return lifted->At(share);
}

// Computes the lift of a point over a sharp edge: both faces move the edge, each along its normal.
// Their components along the point's direction from it count.
double LiftOfEdge(const MeshDistance& mesh, const SurfaceDistance& distance, std::uint32_t other) {
  const Vector3d normal = mesh.FaceNormal(distance.triangle);
  const Vector3d beyond = mesh.FaceNormal(other);
  const double both = normal.dot(beyond);
  const double square = 1 - both * both;
  constexpr double kFolded = 1e-3;
  if (!(square > kFolded)) return 0;
  const double own = distance.outward.dot(normal);
  const double theirs = distance.outward.dot(beyond);
  return ((own - both * theirs) * SmoothLiftAt(mesh, distance.triangle, distance.nearest_mm).mm +
          (theirs - both * own) * SmoothLiftAt(mesh, other, distance.nearest_mm).mm) /
         square;
}

}  // namespace

SmoothDistance SmoothDistanceAt(const MeshDistance& mesh, const SurfaceDistance& distance,
                                const Vector3d& p_mm) {
  const std::uint32_t triangle = distance.triangle;
  const SmoothDistance plain{distance.mm, distance.outward};
  if (mesh.mesh().lifts.empty()) return plain;
  const Vector3d normal = mesh.FaceNormal(triangle);
  if (const auto edge = EdgeUnder(mesh, triangle, distance.nearest_mm)) {
    const std::uint32_t other = mesh.NeighboursOf(triangle)[static_cast<std::size_t>(*edge)];
    if (other == kNoTriangle) return plain;
    const double bend = std::abs(EdgeBend_rad(mesh, triangle, *edge));
    if (bend >= kCrease_rad) {
      return {distance.mm - LiftOfEdge(mesh, distance, other), distance.outward};
    }
    if (OverSharpVertex(mesh, triangle, distance.nearest_mm)) return plain;
  }
  const auto lifted = Lifted(mesh, triangle);
  if (!lifted) return plain;
  // In coordinates of the triangle: x in its plane, the surface at height h(x), and the point at
  // height d over x0. The nearest point satisfies x - x0 = (d - h) h'.
  const double d = normal.dot(p_mm - lifted->from_mm[0]);
  const Vector3d x0 = p_mm - d * normal;
  const Vector3d e1 = normal.unitOrthogonal();
  const Vector3d e2 = normal.cross(e1);
  Eigen::Matrix<double, 3, 2> plane;
  plane << e1, e2;
  Eigen::Matrix2d bent = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d a = plane.transpose() * lifted->by_place[k];
    const Eigen::Vector2d b = plane.transpose() * lifted->by_place[(k + 1) % 3];
    bent += 4 * lifted->middle_mm[k] * (a * b.transpose() + b * a.transpose());
  }
  Eigen::Vector2d x = Eigen::Vector2d::Zero();  // offset from x0
  constexpr int kRounds = 6;
  for (int round = 0;; ++round) {
    const Vector3d at = x0 + plane * x;
    const SmoothLift lift =
        lifted->At({lifted->Share(0, at), lifted->Share(1, at), lifted->Share(2, at)});
    const Eigen::Vector2d slope = plane.transpose() * lift.gradient;
    constexpr double kSteep = 0.5;  // beyond, this is no surface near its triangle
    if (!(slope.norm() < kSteep)) break;
    const double above = d - lift.mm;
    const Eigen::Vector2d miss = x - above * slope;
    constexpr double kStill_mm = 1e-9;
    if (miss.norm() < kStill_mm * (1 + std::abs(d)) || round == kRounds) {
      const Vector3d outward = (normal - lift.gradient).normalized();
      return {above * outward.dot(normal) - (plane * x).dot(outward), outward};
    }
    const Eigen::Matrix2d by_x =
        Eigen::Matrix2d::Identity() + slope * slope.transpose() - above * bent;
    constexpr double kUnclear = 0.05;  // near the centre of curvature of a hollow surface
    if (!(by_x.determinant() > kUnclear)) break;
    x -= by_x.inverse() * miss;
  }
  return {distance.mm - SmoothLiftAt(mesh, triangle, distance.nearest_mm).mm, distance.outward};
}

}  // namespace trammel::part_alignment
