#include "part_alignment/mesh/solid_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

constexpr double kMax_mm = 1e6;

std::string Place(const Vector3d& at_mm) {
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) mm", at_mm.x(), at_mm.y(), at_mm.z());
}

std::string Place(const TriangleMesh& mesh, const MeshEdge& edge) {
  const Triangle& triangle = mesh.triangles[edge.triangle];
  const auto k = static_cast<std::size_t>(edge.corner);
  return Place((mesh.vertices_mm[triangle[k]] + mesh.vertices_mm[triangle[(k + 1) % 3]]) / 2);
}

Result<void> CheckNumbers(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return Fail("it has no triangles");
  if (mesh.triangles.size() > kMaxTriangles) {
    return Fail(
        fmt::format("{} triangles; at most {} are taken: export it with a coarser "
                    "deflection (0.01 mm is fine enough for most parts)",
                    mesh.triangles.size(), kMaxTriangles));
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      const Vector3d& at_mm = mesh.vertices_mm[v];
      if (at_mm.allFinite() && at_mm.cwiseAbs().maxCoeff() <= kMax_mm) continue;
      return Fail(
          fmt::format("triangle {} has a corner at {}; numbers must be finite and within "
                      "{:.0f} mm",
                      t + 1, Place(at_mm), kMax_mm));
    }
  }
  return {};
}

// Drops triangles of two equal corners; only their neighbours' edges are lost with them.
std::size_t LeaveOutCollapsed(TriangleMesh& mesh) {
  const auto collapsed = [](const Triangle& triangle) {
    return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
  };
  if (!mesh.lifts.empty()) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (!collapsed(mesh.triangles[t])) mesh.lifts[kept++] = mesh.lifts[t];
    }
    mesh.lifts.resize(kept);
  }
  return std::erase_if(mesh.triangles, collapsed);
}

// Joins vertices of the rim that agree to the rounding of 32-bit numbers. True if any were joined.
bool JoinRim(TriangleMesh& mesh, const std::vector<MeshEdge>& rim) {
  std::vector<std::uint32_t> on_rim;
  double max_mm = 0;
  for (const MeshEdge& edge : rim) {
    const auto k = static_cast<std::size_t>(edge.corner);
    const Triangle& triangle = mesh.triangles[edge.triangle];
    for (const std::uint32_t v : {triangle[k], triangle[(k + 1) % 3]}) {
      on_rim.push_back(v);
      max_mm = std::max(max_mm, mesh.vertices_mm[v].cwiseAbs().maxCoeff());
    }
  }
  constexpr double kRounding = 4 * 1.2e-7;
  const double near_mm = kRounding * max_mm;
  std::sort(on_rim.begin(), on_rim.end());
  on_rim.erase(std::unique(on_rim.begin(), on_rim.end()), on_rim.end());
  std::stable_sort(on_rim.begin(), on_rim.end(), [&](std::uint32_t a, std::uint32_t b) {
    return mesh.vertices_mm[a].x() < mesh.vertices_mm[b].x();
  });
  std::vector<std::uint32_t> joined(mesh.vertices_mm.size());
  std::iota(joined.begin(), joined.end(), 0U);
  bool any = false;
  constexpr std::size_t kMaxNear = 200;  // with equal x: bounds the time
  for (std::size_t i = 0; i < on_rim.size(); ++i) {
    const Vector3d& at = mesh.vertices_mm[on_rim[i]];
    for (std::size_t j = i + 1; j < std::min(on_rim.size(), i + kMaxNear); ++j) {
      const Vector3d off = mesh.vertices_mm[on_rim[j]] - at;
      if (off.x() > near_mm) break;
      if (off.cwiseAbs().maxCoeff() > near_mm || joined[on_rim[j]] != on_rim[j]) continue;
      joined[on_rim[j]] = joined[on_rim[i]];
      any = true;
    }
  }
  if (!any) return false;
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& v : triangle) v = joined[v];
  }
  LeaveOutCollapsed(mesh);
  return true;
}

Result<MeshTopology> JoinedEdges(TriangleMesh& mesh, bool open, SolidMesh& solid) {
  MeshTopology topology = TopologyOf(mesh);
  if (!topology.rim.empty() && JoinRim(mesh, topology.rim)) {
    const std::size_t before = topology.rim.size();
    topology = TopologyOf(mesh);
    solid.notices.push_back(
        fmt::format("{} open edges were closed: their ends differ by rounding only",
                    before - std::min(before, topology.rim.size())));
  }
  if (!topology.crowded.empty()) {
    return Fail(fmt::format(
        "{} edges have more than two triangles, the first at {}: bodies or sheets touch there; "
        "unite them in the CAD program and export one solid",
        topology.crowded.size(), Place(mesh, topology.crowded.front())));
  }
  if (!topology.rim.empty() && !open) {
    return Fail(fmt::format(
        "the shell is open: {} edges have one triangle only, the first at {}; export a closed "
        "solid, or say \"open\": true of a part of its surface",
        topology.rim.size(), Place(mesh, topology.rim.front())));
  }
  solid.open = !topology.rim.empty();
  return topology;
}

void TurnAll(TriangleMesh& mesh, std::vector<std::array<std::uint32_t, 3>>& neighbours) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) Turn(mesh, neighbours, t);
}

bool Within(const MeshPart& inner, const MeshPart& outer) {
  return (inner.low_mm.array() > outer.low_mm.array()).all() &&
         (inner.high_mm.array() < outer.high_mm.array()).all();
}

std::string Size(const MeshPart& part) {
  const Vector3d size = part.high_mm - part.low_mm;
  return fmt::format("{:.3f} × {:.3f} × {:.3f} mm about {}", size.x(), size.y(), size.z(),
                     Place((part.low_mm + part.high_mm) / 2));
}

// Checks for one solid: a closed part that contains only parts of opposite orientation, its
// cavities.
Result<void> OneSolid(SolidMesh& solid, const std::vector<MeshPart>& parts) {
  const auto outer =
      std::max_element(parts.begin(), parts.end(), [](const MeshPart& a, const MeshPart& b) {
        return (a.high_mm - a.low_mm).squaredNorm() < (b.high_mm - b.low_mm).squaredNorm();
      });
  if (!(std::abs(outer->volume_mm3) > 0)) return Fail("its triangles enclose no volume");
  std::size_t cavities = 0;
  for (const MeshPart& part : parts) {
    if (&part == &*outer) continue;
    if (part.volume_mm3 * outer->volume_mm3 < 0 && Within(part, *outer)) {
      ++cavities;
      continue;
    }
    return Fail(
        fmt::format("{} closed bodies where one solid is wanted: {}, and {}; export the "
                    "part alone, or unite them",
                    parts.size() - cavities, Size(*outer), Size(part)));
  }
  if (cavities > 0) {
    solid.notices.push_back(fmt::format("the solid has {} inner cavities", cavities));
  }
  if (outer->volume_mm3 < 0) {
    TurnAll(solid.mesh, solid.neighbours);
    solid.notices.emplace_back("all triangles faced inwards and were turned");
  }
  return {};
}

}  // namespace

Result<SolidMesh> MakeSolid(TriangleMesh mesh, bool open) {
  TRY(CheckNumbers(mesh));
  SolidMesh solid;
  if (const std::size_t collapsed = LeaveOutCollapsed(mesh); collapsed > 0) {
    solid.notices.push_back(
        fmt::format("{} triangles of no area (two equal corners) were left out", collapsed));
  }
  if (mesh.triangles.empty()) return Fail("all its triangles have no area");
  auto topology = TRY(JoinedEdges(mesh, open, solid));
  if (mesh.triangles.empty()) return Fail("all its triangles have no area");
  solid.neighbours = std::move(topology.neighbours);
  solid.mesh = std::move(mesh);
  const MeshParts found = TurnAlike(solid.mesh, solid.neighbours);
  if (found.one_sided) {
    return Fail(fmt::format(
        "its surface has one side only: it comes back turned at {}; repair it in the CAD program",
        Place(solid.mesh, {*found.one_sided, 0})));
  }
  std::size_t turned = 0;
  for (const MeshPart& part : found.parts) turned += part.turned;
  if (turned > 0) {
    solid.notices.push_back(
        fmt::format("{} of {} triangles faced otherwise than their neighbours "
                    "and were turned",
                    turned, solid.mesh.triangles.size()));
  }
  if (!solid.open) {
    TRY(OneSolid(solid, found.parts));
  } else {
    solid.notices.emplace_back(
        "the shell is open: outside is where its triangles face, and points beyond its rim cannot "
        "be used");
  }
  return solid;
}

}  // namespace trammel::part_alignment
