// How far a mesh may be from the smooth surface that it stands for.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>

#include "part_alignment/mesh/mesh_distance.h"

namespace trammel::part_alignment {

/// Sharper bends are edges of the part.
inline constexpr double kCrease_rad = 0.5236;

/// Estimates how far a triangle is off, from the bends to its neighbours. Across edges that bend by
/// less than 30 degrees the surface is taken as smooth, sharper ones as edges of the part. First
/// order in the bend: exact for spheres and cylinders of even triangles, within a factor of two
/// elsewhere.
struct FacetError {
  /// The most by which the smooth surface bulges out of the triangle: what stock allowance over it
  /// is overstated by. 0 where it is hollow.
  double outward_mm = 0;
  double inward_mm = 0;  ///< the same to the inside, where it is hollow
  double tilt_rad = 0;   ///< the most by which the smooth normal leaves the triangle's
  /// Of meshes with lifts: what the quadratic surface through them misses.
  std::optional<double> left_mm = {};

  [[nodiscard]] double either_mm() const { return std::max(outward_mm, inward_mm); }
};

/// With theta the bends across the edges and h the heights over them, the quadratic surface
/// through the corners deviates by sum(theta h) / 9 in the middle and by the sum over two edges / 8
/// at the middle of the third. Of meshes with lifts by these.
[[nodiscard]] FacetError FacetErrorOf(const MeshDistance& mesh, std::uint32_t triangle);

/// How far a point stands out of the smooth surface.
struct SmoothDistance {
  double mm = 0;
  Eigen::Vector3d outward;  ///< of length 1; the distance's gradient
};

/// From the nearest place of the quadratic surface about the nearest triangle: the triangle's
/// normal would be off by its tilt, the distance by its half square. Over a sharp edge from the
/// edge as both faces' surfaces move it. Of meshes without lifts the distance from the triangle.
/// @param distance  mesh.At(p_mm)
[[nodiscard]] SmoothDistance SmoothDistanceAt(const MeshDistance& mesh,
                                              const SurfaceDistance& distance,
                                              const Eigen::Vector3d& p_mm);

}  // namespace trammel::part_alignment
