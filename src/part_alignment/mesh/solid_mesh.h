// Mesh with a defined inside and outside.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {

/// One closed solid with its cavities, or an open shell; all triangles are oriented alike.
struct SolidMesh {
  TriangleMesh mesh;
  /// Neighbour across the edge from corner k to the next; kNoTriangle (triangle_mesh.h) at a
  /// shell's rim.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  bool open = false;
  std::vector<std::string> notices;  ///< repairs that were made
};

/// Makes a solid, and repairs faults of a single meaning: drops triangles of two equal corners,
/// joins rims that agree to the rounding of 32-bit numbers, turns triangles that are oriented
/// otherwise than their neighbours, turns a solid that is inside out. REQUIRES lifts for all
/// triangles or for none.
/// @param open  true: rims may remain; outside is then where most triangles face.
/// Errors (kInput) name count and place: no triangles, too many, numbers that are not finite or
/// beyond 1e6 mm, a shell that is open, edges of more than two triangles, several solids, a surface
/// with one side. Self-intersections are not checked.
[[nodiscard]] Result<SolidMesh> MakeSolid(TriangleMesh mesh, bool open);

}  // namespace trammel::part_alignment
