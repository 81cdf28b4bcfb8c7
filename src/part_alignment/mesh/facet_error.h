// Deviation of a mesh from the smooth surface that it approximates.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>

#include "part_alignment/mesh/mesh_distance.h"

namespace trammel::part_alignment {

/// Bend above which an edge belongs to the part.
inline constexpr double kCrease_rad = 0.5236;

/// Estimated deviation of a triangle from the surface, by the bends to its neighbours. The surface
/// counts as smooth across bends of less than 30 degrees; sharper bends are edges of the part.
/// First order in the bend: exact for spheres and cylinders of even triangles, within a factor of
/// two elsewhere.
struct FacetError {
  /// Maximum bulge of the smooth surface out of the triangle, by which stock allowance over it is
  /// overstated. 0 where it is hollow.
  double outward_mm = 0;
  double inward_mm = 0;  ///< the same to the inside, where it is hollow
  double tilt_rad = 0;   ///< the most by which the smooth normal leaves the triangle's
  /// Error of the quadratic surface through the lifts, for meshes that have them.
  std::optional<double> left_mm = {};

  [[nodiscard]] double either_mm() const { return std::max(outward_mm, inward_mm); }
};

/// Estimates a facet's deviation from the quadratic surface through the corners; theta are the
/// bends across the edges, h the heights over them. In the middle: sum(theta h) / 9; at the middle
/// of the third edge: the sum over two / 8. For meshes with lifts by these.
[[nodiscard]] FacetError FacetErrorOf(const MeshDistance& mesh, std::uint32_t triangle);

/// Height of a point over the smooth surface.
struct SmoothDistance {
  double mm = 0;
  Eigen::Vector3d outward;  ///< unit vector; the distance's gradient
};

/// Computes the distance from the quadratic surface about the nearest triangle. The triangle's
/// normal would be off by its tilt, the distance by its half square. Over a sharp edge, from the
/// edge as both faces' surfaces move it. For meshes without lifts, from the triangle.
/// @param distance  mesh.At(p_mm)
[[nodiscard]] SmoothDistance SmoothDistanceAt(const MeshDistance& mesh,
                                              const SurfaceDistance& distance,
                                              const Eigen::Vector3d& p_mm);

}  // namespace trammel::part_alignment
