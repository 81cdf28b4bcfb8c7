// How far a mesh may be from the smooth surface that it stands for.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>

#include "part_alignment/mesh/mesh_distance.h"

namespace trammel::part_alignment {

/// Across edges that bend by less than 30 degrees the surface is taken as smooth, sharper ones as
/// edges of the part. Both are of first order in the bend: exact for spheres and cylinders of even
/// triangles, within a factor of two or so elsewhere.
struct FacetError {
  /// The most by which the smooth surface bulges out of the triangle: what stock allowance over it
  /// is overstated by. 0 where it is hollow.
  double outward_mm = 0;
  double inward_mm = 0;  ///< the same to the inside, where it is hollow
  double tilt_rad = 0;   ///< the most by which the smooth normal leaves the triangle's
  /// By how much two ways to see the smooth surface of a corrected triangle differ, from the
  /// normals at its corners and from its neighbours' outer corners; twice either_mm() where they
  /// contradict each other, as beside a flat face. With a twentieth of either_mm() the most that is
  /// left of it after SmoothLiftAt. 0 where it is not corrected.
  double apart_mm = 0;
  /// Of meshes with lifts, whose error is known: what is left of it after SmoothLiftAt.
  std::optional<double> left_mm = {};

  [[nodiscard]] double either_mm() const { return std::max(outward_mm, inward_mm); }
};

/// With theta the bends across the edges and h the heights over them, the quadratic surface
/// through the corners deviates by sum(theta h) / 9 in the middle and by the sum over two edges / 8
/// at the middle of the third.
[[nodiscard]] FacetError FacetErrorOf(const MeshDistance& mesh, std::uint32_t triangle);

/// The quadratic surface of FacetErrorOf over a place of its triangle.
struct SmoothLift {
  double mm = 0;             ///< above 0 outside the triangle
  Eigen::Vector3d gradient;  ///< of it, along the triangle
};

/// Triangles that are farther off are not corrected: where flat faces of a part meet at a small
/// angle there is no smooth surface, and this is the most that is made wrong.
inline constexpr double kMostLift_mm = 0.02;

/// Of meshes with lifts by these. Otherwise none where the triangle's error is above kMostLift_mm.
[[nodiscard]] SmoothLift SmoothLiftAt(const MeshDistance& mesh, std::uint32_t triangle,
                                      const Eigen::Vector3d& on_triangle_mm);

/// How far a point stands out of the smooth surface.
struct SmoothDistance {
  double mm = 0;
  Eigen::Vector3d outward;  ///< of length 1; the distance's gradient
};

/// From the nearest place of the quadratic surface about the nearest triangle: the triangle's
/// normal would be off by its tilt, the distance by its half square. Over a sharp edge from the
/// edge as both faces' surfaces move it; where there is no lift from the triangle.
/// @param distance  mesh.At(p_mm)
[[nodiscard]] SmoothDistance SmoothDistanceAt(const MeshDistance& mesh,
                                              const SurfaceDistance& distance,
                                              const Eigen::Vector3d& p_mm);

/// The bend across the edge from corner k to the next, above 0 where the solid is convex; 0 at a
/// rim.
[[nodiscard]] double EdgeBend_rad(const MeshDistance& mesh, std::uint32_t triangle, int corner);

/// Sharper bends are edges of the part.
inline constexpr double kCrease_rad = 0.5236;

}  // namespace trammel::part_alignment
