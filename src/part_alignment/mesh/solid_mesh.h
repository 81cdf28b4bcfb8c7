// A mesh that tells inside from outside.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {

/// One closed solid, cavities and all, or an open shell; all triangles turned alike.
struct SolidMesh {
  TriangleMesh mesh;
  /// Across the edge from corner k to the next; kNoTriangle (mesh_topology.h) at a shell's rim.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  bool open = false;
  std::vector<std::string> notices;  ///< what was mended
};

/// Mends what has one meaning only: triangles of two equal corners are left out, rims that agree
/// to the rounding of 32-bit numbers are joined, triangles that are turned otherwise than their
/// neighbours are turned, a solid that is inside out is turned.
/// REQUIRES lifts for all triangles or for none.
/// @param open  whether rims may be left; outside is then where most triangles face.
/// Errors (kInput) name count and place: no triangles, too many, numbers that are not finite or
/// beyond 1e6 mm, a shell that is open, edges of more than two triangles, several solids, a
/// surface with one side. Self-intersections are not looked for.
[[nodiscard]] Result<SolidMesh> MakeSolid(TriangleMesh mesh, bool open);

}  // namespace trammel::part_alignment
