#include "part_alignment/mesh/triangle_mesh.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using Neighbours = std::vector<std::array<std::uint32_t, 3>>;

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

std::uint64_t Mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31);
}

std::uint64_t HashOf(const Eigen::Vector3d& at_mm) {
  std::uint64_t hash = 0x9e3779b97f4a7c15U;
  for (const double mm : at_mm) hash = Mixed(hash + std::bit_cast<std::uint64_t>(mm + 0.0));
  return hash;
}

// Edge, stored at its lower vertex.
struct HalfEdge {
  std::uint32_t higher = 0;
  std::uint32_t triangle = 0;
  int corner = 0;
};

void Join(const std::vector<HalfEdge>& edges, std::size_t first, std::size_t last,
          MeshTopology& topology) {
  const HalfEdge& a = edges[first];
  if (last - first == 1) {
    topology.rim.push_back({a.triangle, a.corner});
  } else if (last - first == 2) {
    const HalfEdge& b = edges[first + 1];
    topology.neighbours[a.triangle][static_cast<std::size_t>(a.corner)] = b.triangle;
    topology.neighbours[b.triangle][static_cast<std::size_t>(b.corner)] = a.triangle;
  } else {
    topology.crowded.push_back({a.triangle, a.corner});
  }
}

constexpr std::uint32_t kNoPart = kNoTriangle;

// Walks over one part from its first triangle. `against`: orientation opposite to that one.
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
    // Relative to a point of its own, so that a part far from the origin retains its digits.
    const Vector3d at = mesh.vertices_mm[triangle[0]] - *first;
    part.volume_mm3 += AreaVector(mesh, triangle).dot(at) / 6;
  }
}

}  // namespace

std::uint32_t VertexWeld::Number(const Eigen::Vector3d& at_mm) {
  if (2 * vertices_mm_.size() >= slots_.size()) Grow();
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = HashOf(at_mm) & mask;
  constexpr int kLongestChain = 2000;  // half full, chance makes none of 100
  for (int probe = 0; probe < kLongestChain && slots_[slot] != kFree; ++probe) {
    if (vertices_mm_[slots_[slot]] == at_mm) return slots_[slot];
    slot = (slot + 1) & mask;
  }
  const auto number = static_cast<std::uint32_t>(vertices_mm_.size());
  vertices_mm_.push_back(at_mm);
  if (slots_[slot] == kFree) slots_[slot] = number;
  return number;
}

void VertexWeld::Grow() {
  constexpr std::size_t kFirst = 1024;
  slots_.assign(slots_.empty() ? kFirst : 2 * slots_.size(), kFree);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t i = 0; i < vertices_mm_.size(); ++i) {
    std::size_t slot = HashOf(vertices_mm_[i]) & mask;
    constexpr int kLongestChain = 2000;
    for (int probe = 0; probe < kLongestChain && slots_[slot] != kFree; ++probe) {
      slot = (slot + 1) & mask;
    }
    if (slots_[slot] == kFree) slots_[slot] = static_cast<std::uint32_t>(i);
  }
}

MeshTopology TopologyOf(const TriangleMesh& mesh) {
  MeshTopology topology;
  topology.neighbours.assign(mesh.triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  std::vector<std::uint32_t> begins(mesh.vertices_mm.size() + 1, 0);
  const auto lower = [](const Triangle& triangle, std::size_t k) {
    return std::min(triangle[k], triangle[(k + 1) % 3]);
  };
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++begins[lower(triangle, k) + 1];
  }
  for (std::size_t v = 1; v < begins.size(); ++v) begins[v] += begins[v - 1];
  std::vector<HalfEdge> edges(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      edges[next[lower(triangle, k)]++] = {std::max(triangle[k], triangle[(k + 1) % 3]),
                                           static_cast<std::uint32_t>(t), static_cast<int>(k)};
    }
  }
  for (std::size_t v = 0; v + 1 < begins.size(); ++v) {
    const auto at = [&](std::uint32_t i) { return edges.begin() + i; };
    std::sort(at(begins[v]), at(begins[v + 1]), [](const HalfEdge& a, const HalfEdge& b) {
      return a.higher != b.higher ? a.higher < b.higher : a.triangle < b.triangle;
    });
    for (std::size_t first = begins[v]; first < begins[v + 1];) {
      std::size_t last = first + 1;
      while (last < begins[v + 1] && edges[last].higher == edges[first].higher) ++last;
      Join(edges, first, last, topology);
      first = last;
    }
  }
  return topology;
}

bool SameDirection(const Triangle& a, int corner, const Triangle& b) {
  const std::uint32_t from = a[static_cast<std::size_t>(corner)];
  const std::uint32_t to = a[static_cast<std::size_t>((corner + 1) % 3)];
  for (std::size_t k = 0; k < 3; ++k) {
    if (b[k] == from && b[(k + 1) % 3] == to) return true;
  }
  return false;
}

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
