#include "part_alignment/mesh/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "part_alignment/mesh/mesh_topology.h"
#include "part_alignment/mesh/nearest_on_triangle.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

// Vertices in the order in which the leaves come to them, without those that no triangle has.
void RenumberVertices(TriangleMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertices_mm.size(), kNoTriangle);
  std::vector<Vector3d> vertices_mm;
  vertices_mm.reserve(mesh.vertices_mm.size());
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& v : triangle) {
      if (number[v] == kNoTriangle) {
        number[v] = static_cast<std::uint32_t>(vertices_mm.size());
        vertices_mm.push_back(mesh.vertices_mm[v]);
      }
      v = number[v];
    }
  }
  mesh.vertices_mm = std::move(vertices_mm);
}

double AngleBetween(const Vector3d& u, const Vector3d& v) {
  const Vector3d cross(u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
                       u.x() * v.y() - u.y() * v.x());
  return std::atan2(cross.norm(), u.dot(v));
}

}  // namespace

MeshDistance::MeshDistance(SolidMesh solid) : open_(solid.open) {
  BoxTree tree = BuildBoxTree(solid.mesh);
  const std::size_t n = solid.mesh.triangles.size();
  std::vector<std::uint32_t> place(n);
  for (std::size_t i = 0; i < n; ++i) place[tree.triangle[i]] = static_cast<std::uint32_t>(i);
  mesh_.vertices_mm = std::move(solid.mesh.vertices_mm);
  mesh_.triangles.resize(n);
  mesh_.lifts.resize(solid.mesh.lifts.size());
  neighbours_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t t = tree.triangle[i];
    mesh_.triangles[i] = solid.mesh.triangles[t];
    if (!mesh_.lifts.empty()) mesh_.lifts[i] = solid.mesh.lifts[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t other = solid.neighbours[t][k];
      neighbours_[i][k] = other == kNoTriangle ? kNoTriangle : place[other];
    }
  }
  nodes_ = std::move(tree.nodes);
  RenumberVertices(mesh_);
  FindNormals();
  FindVertexNormals();
}

void MeshDistance::FindNormals() {
  double most_mm = 0;
  for (const Vector3d& at : mesh_.vertices_mm)
    most_mm = std::max(most_mm, at.cwiseAbs().maxCoeff());
  // Numbers of 32 bits leave a height below some of their roundings undetermined.
  const double least_height_mm = 4 * 6e-8 * most_mm;
  const std::size_t n = mesh_.triangles.size();
  normals_.resize(n);
  sliver_.assign(n, false);
  for (std::size_t t = 0; t < n; ++t) {
    const Triangle& triangle = mesh_.triangles[t];
    const Vector3d area = AreaVector(mesh_, triangle);
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      longest = std::max(
          longest,
          (mesh_.vertices_mm[triangle[(k + 1) % 3]] - mesh_.vertices_mm[triangle[k]]).norm());
    }
    const double twice = area.norm();
    sliver_[t] = !(twice > least_height_mm * longest);
    if (sliver_[t]) ++slivers_;
    normals_[t] = twice > 0 ? Vector3d(area / twice) : Vector3d::Zero();
  }
  for (std::size_t t = 0; t < n; ++t) {
    if (!sliver_[t]) continue;
    Vector3d sum = Vector3d::Zero();
    for (const std::uint32_t other : neighbours_[t]) {
      if (other != kNoTriangle && !sliver_[other]) sum += normals_[other];
    }
    if (sum.norm() > 0) normals_[t] = sum.normalized();
  }
}

void MeshDistance::FindVertexNormals() {
  vertex_normals_.assign(mesh_.vertices_mm.size(), Vector3d::Zero());
  rim_vertex_.assign(mesh_.vertices_mm.size(), false);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const Triangle& triangle = mesh_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& at = mesh_.vertices_mm[triangle[k]];
      const double angle = AngleBetween(mesh_.vertices_mm[triangle[(k + 1) % 3]] - at,
                                        mesh_.vertices_mm[triangle[(k + 2) % 3]] - at);
      vertex_normals_[triangle[k]] += angle * normals_[t];
      if (neighbours_[t][k] != kNoTriangle) continue;
      rim_vertex_[triangle[k]] = true;
      rim_vertex_[triangle[(k + 1) % 3]] = true;
    }
  }
}

Vector3d MeshDistance::PseudoNormal(std::uint32_t triangle, int feature) const {
  if (feature == 0) return normals_[triangle];
  if (feature > 3) {
    return vertex_normals_[mesh_.triangles[triangle][static_cast<std::size_t>(feature - 4)]];
  }
  const std::uint32_t other = neighbours_[triangle][static_cast<std::size_t>(feature - 1)];
  if (other == kNoTriangle) return normals_[triangle];
  return normals_[triangle] + normals_[other];
}

bool MeshDistance::AtRim(std::uint32_t triangle, int feature) const {
  if (!open_ || feature == 0) return false;
  if (feature > 3) {
    return rim_vertex_[mesh_.triangles[triangle][static_cast<std::size_t>(feature - 4)]];
  }
  return neighbours_[triangle][static_cast<std::size_t>(feature - 1)] == kNoTriangle;
}

SurfaceDistance MeshDistance::At(const Vector3d& p_mm) const {
  struct Visit {
    double distance2;
    std::uint32_t node;
  };
  std::array<Visit, 64> open;  // each inner node leaves one behind; the tree is 25 deep at most
  std::size_t count = 0;
  open[count++] = {SquaredDistance(nodes_[0], p_mm), 0};
  double least2 = std::numeric_limits<double>::infinity();
  NearestOnTriangle nearest;
  std::uint32_t at = 0;
  while (count > 0) {
    const Visit visit = open[--count];
    if (visit.distance2 >= least2) continue;
    const BoxNode& node = nodes_[visit.node];
    if (node.triangles == 0) {
      Visit near{SquaredDistance(nodes_[node.first], p_mm), node.first};
      Visit far{SquaredDistance(nodes_[node.first + 1], p_mm), node.first + 1};
      if (far.distance2 < near.distance2) std::swap(near, far);
      if (far.distance2 < least2) open[count++] = far;
      if (near.distance2 < least2) open[count++] = near;
      continue;
    }
    for (std::uint32_t t = node.first; t < node.first + node.triangles; ++t) {
      const Triangle& triangle = mesh_.triangles[t];
      const NearestOnTriangle found =
          NearestPoint(p_mm, mesh_.vertices_mm[triangle[0]], mesh_.vertices_mm[triangle[1]],
                       mesh_.vertices_mm[triangle[2]], sliver_[t]);
      const double distance2 = (p_mm - found.at_mm).squaredNorm();
      if (distance2 < least2) {
        least2 = distance2;
        nearest = found;
        at = t;
      }
    }
  }
  const int feature = static_cast<int>(nearest.feature);
  const Vector3d pseudo = PseudoNormal(at, feature).stableNormalized();
  const Vector3d off = p_mm - nearest.at_mm;
  const double distance = std::sqrt(least2);
  const double sign = off.dot(pseudo) < 0 ? -1 : 1;
  SurfaceDistance result{sign * distance, pseudo, nearest.at_mm, at, AtRim(at, feature)};
  // Nearer than its rounding allows, the difference has no direction.
  const double rounding_mm = 1e-9 * (1 + p_mm.cwiseAbs().maxCoeff());
  if (distance > rounding_mm) result.outward = sign / distance * off;
  if (nearest.feature == TriangleFeature::kFace) result.outward = normals_[at];
  return result;
}

}  // namespace trammel::part_alignment
