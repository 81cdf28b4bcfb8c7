// Surface as triangles: welded corners, neighbours and connected parts.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace trammel::part_alignment {

/// Vertices of a triangle, counter-clockwise seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// Height of the part's own surface over a triangle whose corners are on it.
struct TriangleLift {
  /// Height over the middle of the edge from corner k to the next, above 0 outside.
  std::array<float, 3> middle_mm{};
  float left_mm = 0;  ///< maximum error of the quadratic surface through corners and middles
};

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Triangle> triangles;
  /// Lift of each triangle; empty if only the triangles are known.
  std::vector<TriangleLift> lifts = {};
};

/// Maximum number of triangles read: 250 MB of a binary STL, some 0.9 GB of memory meanwhile.
inline constexpr std::size_t kMaxTriangles = 5'000'000;

/// Returns twice the triangle's area times its unit normal, by the right hand.
[[nodiscard]] inline Eigen::Vector3d AreaVector(const TriangleMesh& mesh,
                                                const Triangle& triangle) {
  const Eigen::Vector3d& a = mesh.vertices_mm[triangle[0]];
  const Eigen::Vector3d u = mesh.vertices_mm[triangle[1]] - a;
  const Eigen::Vector3d v = mesh.vertices_mm[triangle[2]] - a;
  return {u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
          u.x() * v.y() - u.y() * v.x()};
}

/// Numbers places in the order of their first appearance. Equal places (to the last bit, -0 as 0)
/// share a number. Time is bounded for any input: where hashes collide more often than by chance,
/// equal places may get numbers of their own.
class VertexWeld {
 public:
  [[nodiscard]] std::uint32_t Number(const Eigen::Vector3d& at_mm);
  [[nodiscard]] std::size_t size() const { return vertices_mm_.size(); }
  [[nodiscard]] std::vector<Eigen::Vector3d> Take() { return std::move(vertices_mm_); }

 private:
  void Grow();

  std::vector<Eigen::Vector3d> vertices_mm_;
  std::vector<std::uint32_t> slots_;  // a power of two of them
};

inline constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

/// Edge of a triangle: from its corner `corner` to the next.
struct MeshEdge {
  std::uint32_t triangle = 0;
  int corner = 0;
};

struct MeshTopology {
  /// Neighbours of each triangle across its edge from corner k to the next; kNoTriangle at a rim.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  std::vector<MeshEdge> rim;  ///< edges of one triangle only
  /// Edges of more than two triangles, each listed once.
  std::vector<MeshEdge> crowded;
};

/// REQUIRES at most kMaxTriangles, three different vertices in each.
/// Cost: n log n for any mesh, 0.2 s for a million triangles.
[[nodiscard]] MeshTopology TopologyOf(const TriangleMesh& mesh);

/// True if two triangles run along their common edge in one direction, so that one is reversed.
/// REQUIRES neighbours.
[[nodiscard]] bool SameDirection(const Triangle& a, int corner, const Triangle& b);

struct MeshPart {
  std::size_t triangles = 0;
  std::size_t turned = 0;  ///< triangles flipped to match most of the part
  double volume_mm3 = 0;   ///< signed; of a closed part, below 0 where it is inside out
  Eigen::Vector3d low_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_mm = Eigen::Vector3d::Zero();
};

struct MeshParts {
  std::vector<MeshPart> parts;
  std::vector<std::uint32_t> part_of;  ///< each triangle's
  /// Triangle at which a one-sided surface meets its own other side.
  std::optional<std::uint32_t> one_sided;
};

/// Turns triangles in place so that all are oriented alike; neighbours follow. The majority of a
/// part's triangles decides.
[[nodiscard]] MeshParts TurnAlike(TriangleMesh& mesh,
                                  std::vector<std::array<std::uint32_t, 3>>& neighbours);

/// Reverses a triangle, with its neighbours and its lift.
void Turn(TriangleMesh& mesh, std::vector<std::array<std::uint32_t, 3>>& neighbours,
          std::size_t triangle);

}  // namespace trammel::part_alignment
