#include "part_alignment/mesh/mesh_topology.h"

#include <algorithm>

namespace trammel::part_alignment {
namespace {

// An edge at its lower vertex.
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

}  // namespace

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

}  // namespace trammel::part_alignment
