// Which triangles of a mesh meet at which edges.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {

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

}  // namespace trammel::part_alignment
