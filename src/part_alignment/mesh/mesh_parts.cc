#include "part_alignment/mesh/mesh_parts.h"

#include <utility>

#include "part_alignment/mesh/mesh_topology.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using Neighbours = std::vector<std::array<std::uint32_t, 3>>;

constexpr std::uint32_t kNoPart = kNoTriangle;

// Walks over one part from its first triangle. `against`: turned otherwise than that one.
void Walk(const TriangleMesh& mesh, const Neighbours& neighbours, std::uint32_t first,
          std::vector<bool>& against, MeshParts& found) {
  const auto part = static_cast<std::uint32_t>(found.parts.size());
  std::vector<std::uint32_t> front = {first};
  found.part_of[first] = part;
  while (!front.empty()) {
    const std::uint32_t t = front.back();
    front.pop_back();
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t other = neighbours[t][static_cast<std::size_t>(k)];
      if (other == kNoTriangle) continue;
      const bool expected =
          against[t] != SameDirection(mesh.triangles[t], k, mesh.triangles[other]);
      if (found.part_of[other] == kNoPart) {
        found.part_of[other] = part;
        against[other] = expected;
        front.push_back(other);
      } else if (against[other] != expected && !found.one_sided) {
        found.one_sided = other;
      }
    }
  }
}

void Measure(const TriangleMesh& mesh, MeshParts& found) {
  std::vector<const Vector3d*> first_mm(found.parts.size(), nullptr);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    MeshPart& part = found.parts[found.part_of[t]];
    const Triangle& triangle = mesh.triangles[t];
    const Vector3d*& first = first_mm[found.part_of[t]];
    if (first == nullptr) {
      first = &mesh.vertices_mm[triangle[0]];
      part.low_mm = part.high_mm = *first;
    }
    for (const std::uint32_t v : triangle) {
      part.low_mm = part.low_mm.cwiseMin(mesh.vertices_mm[v]);
      part.high_mm = part.high_mm.cwiseMax(mesh.vertices_mm[v]);
    }
    // About a place of its own, so that a part far from the origin keeps its digits.
    const Vector3d at = mesh.vertices_mm[triangle[0]] - *first;
    part.volume_mm3 += AreaVector(mesh, triangle).dot(at) / 6;
  }
}

}  // namespace

void Turn(TriangleMesh& mesh, Neighbours& neighbours, std::size_t triangle) {
  std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
  std::swap(neighbours[triangle][0], neighbours[triangle][2]);
  if (mesh.lifts.empty()) return;
  std::array<float, 3>& middle_mm = mesh.lifts[triangle].middle_mm;
  std::swap(middle_mm[0], middle_mm[2]);
  for (float& mm : middle_mm) mm = -mm;
}

MeshParts TurnAlike(TriangleMesh& mesh, Neighbours& neighbours) {
  MeshParts found;
  found.part_of.assign(mesh.triangles.size(), kNoPart);
  std::vector<bool> against(mesh.triangles.size(), false);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (found.part_of[t] != kNoPart) continue;
    Walk(mesh, neighbours, t, against, found);
    found.parts.emplace_back();
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    MeshPart& part = found.parts[found.part_of[t]];
    ++part.triangles;
    if (against[t]) ++part.turned;
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const MeshPart& part = found.parts[found.part_of[t]];
    const bool minority = 2 * part.turned <= part.triangles;
    if (against[t] == minority) Turn(mesh, neighbours, t);
  }
  for (MeshPart& part : found.parts) {
    if (2 * part.turned > part.triangles) part.turned = part.triangles - part.turned;
  }
  Measure(mesh, found);
  return found;
}

}  // namespace trammel::part_alignment
