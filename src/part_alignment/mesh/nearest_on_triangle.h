// The point of a triangle that is nearest to another point.
#pragma once

#include <Eigen/Core>

namespace trammel::part_alignment {

/// Where on the triangle: inside, on the edge from corner k to the next, at corner k.
enum class TriangleFeature { kFace, kEdge0, kEdge1, kEdge2, kCorner0, kCorner1, kCorner2 };

struct NearestOnTriangle {
  Eigen::Vector3d at_mm;
  TriangleFeature feature = TriangleFeature::kFace;
};

/// By the regions of Voronoi that the edges make (Ericson, Real-Time Collision Detection, 2005,
/// chapter 5.1.5).
/// @param flat  the corners lie in one line to the rounding of their numbers: only edges and
///              corners are looked at.
[[nodiscard]] NearestOnTriangle NearestPoint(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& a,
                                             const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                                             bool flat);

}  // namespace trammel::part_alignment
