// A surface as triangles: welded corners, neighbours and connected parts.
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

/// Numbers places in the order in which they first come; equal ones (to the last bit, -0 as 0) get
/// one number. Time is bounded for any input: where hashes collide more often than chance has it,
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

/// An edge by one of its triangles: from its corner `corner` to the next.
struct MeshEdge {
  std::uint32_t triangle = 0;
  int corner = 0;
};

struct MeshTopology {
  /// For each triangle the one across its edge from corner k to the next; kNoTriangle at a rim.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  std::vector<MeshEdge> rim;  ///< edges of one triangle only
  /// Edges of more than two triangles, each once.
  std::vector<MeshEdge> crowded;
};

/// REQUIRES at most kMostTriangles, three different vertices in each.
/// Cost: n log n for any mesh, 0.2 s for a million triangles.
[[nodiscard]] MeshTopology TopologyOf(const TriangleMesh& mesh);

/// Of two triangles with a common edge: whether both run along it in one direction, so that one of
/// them is the other way round. REQUIRES neighbours.
[[nodiscard]] bool SameDirection(const Triangle& a, int corner, const Triangle& b);

struct MeshPart {
  std::size_t triangles = 0;
  std::size_t turned = 0;  ///< that were the other way round than most of the part
  double volume_mm3 = 0;   ///< signed; of a closed part, below 0 where it is inside out
  Eigen::Vector3d low_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_mm = Eigen::Vector3d::Zero();
};

struct MeshParts {
  std::vector<MeshPart> parts;
  std::vector<std::uint32_t> part_of;  ///< each triangle's
  /// A triangle at which the surface comes back to its own other side.
  std::optional<std::uint32_t> one_sided;
};

/// Turns triangles in place; neighbours follow. Most triangles of a part decide.
[[nodiscard]] MeshParts TurnAlike(TriangleMesh& mesh,
                                  std::vector<std::array<std::uint32_t, 3>>& neighbours);

/// Turns a triangle the other way round, with its neighbours and its lift.
void Turn(TriangleMesh& mesh, std::vector<std::array<std::uint32_t, 3>>& neighbours,
          std::size_t triangle);

}  // namespace trammel::part_alignment
