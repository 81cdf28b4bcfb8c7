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

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Triangle> triangles;
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
