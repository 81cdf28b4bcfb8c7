#include "part_alignment/report/part_outline.h"

#include <cmath>
#include <cstdint>
#include <set>

#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/mesh/mesh_topology.h"

namespace trammel::report {
namespace {

using part_alignment::MeshDistance;

// Whether one of the two faces along an axis and the other against it.
bool Turns(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return ((a.array() > 0) != (b.array() > 0)).any();
}

void AddOutline(const MeshDistance& mesh, std::vector<OutlineEdge>& outline) {
  const auto count = static_cast<std::uint32_t>(mesh.mesh().triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = mesh.NeighboursOf(t)[k];
      const bool rim = other == part_alignment::kNoTriangle;
      if (!rim && other < t) continue;
      const Eigen::Vector3d normal = mesh.FaceNormal(t);
      const Eigen::Vector3d beyond = rim ? Eigen::Vector3d(-normal) : mesh.FaceNormal(other);
      const bool sharp = rim || normal.dot(beyond) < std::cos(part_alignment::kCrease_rad);
      if (!sharp && !Turns(normal, beyond)) continue;
      const auto& corners = mesh.mesh().triangles[t];
      outline.push_back({mesh.mesh().vertices_mm[corners[k]],
                         mesh.mesh().vertices_mm[corners[(k + 1) % 3]], normal, beyond, sharp});
    }
  }
}

}  // namespace

std::vector<OutlineEdge> OutlineOf(const part_alignment::PartFitInput& input) {
  std::vector<OutlineEdge> outline;
  std::set<const MeshDistance*> drawn;  // several surfaces may be on one mesh
  for (const part_alignment::IdealSurface& surface : input.surfaces) {
    if (surface.mesh != nullptr && drawn.insert(surface.mesh.get()).second) {
      AddOutline(*surface.mesh, outline);
    }
  }
  return outline;
}

}  // namespace trammel::report
