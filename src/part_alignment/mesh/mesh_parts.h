// The connected parts of a mesh, each with its triangles turned alike.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {

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
