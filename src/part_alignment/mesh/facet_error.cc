#include "part_alignment/mesh/facet_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "part_alignment/mesh/mesh_topology.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

double HeightOver(const MeshDistance& mesh, std::uint32_t triangle, double edge_mm) {
  return AreaVector(mesh.mesh(), mesh.mesh().triangles[triangle]).norm() / edge_mm;
}

struct Bends {
  std::array<double, 3> middle_mm{};  // of the quadratic surface over the middles of the edges
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
    // A flat face beside a round of narrow strips is no more bent than those are.
    const double height_mm = std::min(own_mm, HeightOver(mesh, other, edge_mm));
    lift[at] = bend * height_mm;
    bends.error.tilt_rad = std::max(bends.error.tilt_rad, std::abs(bend) / 2 * height_mm / own_mm);
  }
  const double all = lift[0] + lift[1] + lift[2];
  for (std::size_t k = 0; k < 3; ++k) bends.middle_mm[k] = (all - lift[k]) / 8;
  for (const double mm : {all / 9, bends.middle_mm[0], bends.middle_mm[1], bends.middle_mm[2]}) {
    bends.error.outward_mm = std::max(bends.error.outward_mm, mm);
    bends.error.inward_mm = std::max(bends.error.inward_mm, -mm);
  }
  return bends;
}

std::size_t CornerAt(const Triangle& triangle, std::uint32_t vertex) {
  return triangle[0] == vertex ? 0 : triangle[1] == vertex ? 1 : 2;
}

// Of the smooth surface at a vertex: the angle-weighted mean of the faces about it that no sharp
// edge parts from this one.
Vector3d SmoothNormal(const MeshDistance& mesh, std::uint32_t from, std::uint32_t vertex) {
  const double sharp = std::cos(kCrease_rad);
  const std::vector<Triangle>& triangles = mesh.mesh().triangles;
  const auto weighted = [&](std::uint32_t t) -> Vector3d {
    const std::size_t k = CornerAt(triangles[t], vertex);
    const Vector3d& at = mesh.mesh().vertices_mm[vertex];
    const Vector3d u = mesh.mesh().vertices_mm[triangles[t][(k + 1) % 3]] - at;
    const Vector3d v = mesh.mesh().vertices_mm[triangles[t][(k + 2) % 3]] - at;
    return std::atan2(u.cross(v).norm(), u.dot(v)) * mesh.FaceNormal(t);
  };
  Vector3d sum = weighted(from);
  for (const std::size_t side : {0U, 2U}) {  // around it one way, and the other where that ends
    std::uint32_t t = from;
    constexpr int kMostFaces = 100;
    for (int i = 0; i < kMostFaces; ++i) {
      const std::size_t k = (CornerAt(triangles[t], vertex) + side) % 3;
      const std::uint32_t other = mesh.NeighboursOf(t)[k];
      if (other == from) return sum.normalized();
      if (other == kNoTriangle || mesh.FaceNormal(t).dot(mesh.FaceNormal(other)) < sharp) break;
      sum += weighted(other);
      t = other;
    }
  }
  return sum.normalized();
}

// The same from the normals at the corners: better among uneven triangles, and nonsense where a
// flat face of a part begins; so only near what the bends say.
void Improve(const MeshDistance& mesh, std::uint32_t triangle, Bends& bends) {
  const Triangle& corners = mesh.mesh().triangles[triangle];
  std::array<Vector3d, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) normals[k] = SmoothNormal(mesh, triangle, corners[k]);
  const double near_mm = 0.7 * bends.error.either_mm();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const Vector3d along =
        mesh.mesh().vertices_mm[corners[next]] - mesh.mesh().vertices_mm[corners[k]];
    const double middle_mm = along.dot(normals[next] - normals[k]) / 8;
    if (std::abs(middle_mm - bends.middle_mm[k]) < near_mm) bends.middle_mm[k] = middle_mm;
  }
}

}  // namespace

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

FacetError FacetErrorOf(const MeshDistance& mesh, std::uint32_t triangle) {
  return BendsOf(mesh, triangle).error;
}

SmoothLift SmoothLiftAt(const MeshDistance& mesh, std::uint32_t triangle, const Vector3d& at) {
  SmoothLift lift{0, Vector3d::Zero()};
  Bends bends = BendsOf(mesh, triangle);
  const double error_mm = bends.error.either_mm();
  if (!(error_mm > 0 && error_mm <= kMostLift_mm)) return lift;
  Improve(mesh, triangle, bends);
  const Triangle& triangle_of = mesh.mesh().triangles[triangle];
  const Vector3d area = AreaVector(mesh.mesh(), triangle_of);
  const double twice2 = area.squaredNorm();
  std::array<double, 3> share{};  // barycentric
  std::array<Vector3d, 3> by_place;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d& from = mesh.mesh().vertices_mm[triangle_of[(k + 1) % 3]];
    const Vector3d opposite = mesh.mesh().vertices_mm[triangle_of[(k + 2) % 3]] - from;
    by_place[k] = area.cross(opposite) / twice2;
    share[k] = std::clamp(by_place[k].dot(at - from), 0.0, 1.0);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const double middle_mm = bends.middle_mm[k];
    lift.mm += 4 * share[k] * share[next] * middle_mm;
    lift.gradient += 4 * middle_mm * (share[k] * by_place[next] + share[next] * by_place[k]);
  }
  return lift;
}

}  // namespace trammel::part_alignment
