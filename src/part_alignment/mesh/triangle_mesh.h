// A surface made of triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trammel::part_alignment {

/// Three vertices, counter-clockwise seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// How far the part's own surface stands out of a triangle whose corners lie on it.
struct TriangleLift {
  /// Over the middle of the edge from corner k to the next, above 0 outside.
  std::array<float, 3> middle_mm{};
  float left_mm = 0;  ///< what the quadratic surface through corners and middles misses, at most
};

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Triangle> triangles;
  /// One for each triangle; none where nothing but the triangles is known.
  std::vector<TriangleLift> lifts = {};
};

/// The most that is read: 250 MB of a binary STL, some 0.9 GB of memory while it is.
inline constexpr std::size_t kMostTriangles = 5'000'000;

/// Twice its area times its unit normal, by the right hand.
[[nodiscard]] inline Eigen::Vector3d AreaVector(const TriangleMesh& mesh,
                                                const Triangle& triangle) {
  const Eigen::Vector3d& a = mesh.vertices_mm[triangle[0]];
  const Eigen::Vector3d u = mesh.vertices_mm[triangle[1]] - a;
  const Eigen::Vector3d v = mesh.vertices_mm[triangle[2]] - a;
  return {u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
          u.x() * v.y() - u.y() * v.x()};
}

}  // namespace trammel::part_alignment
