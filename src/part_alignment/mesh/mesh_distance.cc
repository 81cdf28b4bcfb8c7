#include "part_alignment/mesh/mesh_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "part_alignment/mesh/triangle_mesh.h"

namespace trammel::part_alignment {
namespace {

using Three = std::array<float, 3>;
using Eigen::Vector3d;
using enum TriangleFeature;

struct BoxTree {
  std::vector<BoxNode> nodes;           ///< the first is the root
  std::vector<std::uint32_t> triangle;  ///< mesh's triangle number, in the order of the leaves
};

struct Centre {
  Three at_mm{};
  std::uint32_t triangle = 0;
};

std::vector<Centre> CentresOf(const TriangleMesh& mesh) {
  std::vector<Centre> centres(mesh.triangles.size());
  for (std::size_t t = 0; t < centres.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    const Eigen::Vector3d sum = mesh.vertices_mm[triangle[0]] + mesh.vertices_mm[triangle[1]] +
                                mesh.vertices_mm[triangle[2]];
    for (std::size_t i = 0; i < 3; ++i) {
      centres[t].at_mm[i] = static_cast<float>(sum[static_cast<Eigen::Index>(i)] / 3);
    }
    centres[t].triangle = static_cast<std::uint32_t>(t);
  }
  return centres;
}

std::size_t LongestSide(const std::vector<Centre>& centres, std::size_t first, std::size_t last) {
  Three low = centres[first].at_mm;
  Three high = low;
  for (std::size_t i = first + 1; i < last; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centres[i].at_mm[k]);
      high[k] = std::max(high[k], centres[i].at_mm[k]);
    }
  }
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[longest] - low[longest]) longest = k;
  }
  return longest;
}

void BoundLeaf(const TriangleMesh& mesh, const BoxTree& tree, BoxNode& node) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  node.low_mm.fill(kInfinity);
  node.high_mm.fill(-kInfinity);
  for (std::uint32_t i = node.first; i < node.first + node.triangles; ++i) {
    for (const std::uint32_t v : mesh.triangles[tree.triangle[i]]) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = static_cast<float>(mesh.vertices_mm[v][static_cast<Eigen::Index>(k)]);
        node.low_mm[k] = std::min(node.low_mm[k], std::nextafter(at, -kInfinity));
        node.high_mm[k] = std::max(node.high_mm[k], std::nextafter(at, kInfinity));
      }
    }
  }
}

// Children follow their parents.
void BoundAll(const TriangleMesh& mesh, BoxTree& tree) {
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {
    BoxNode& node = tree.nodes[i];
    if (node.triangles > 0) {
      BoundLeaf(mesh, tree, node);
      continue;
    }
    const BoxNode& a = tree.nodes[node.first];
    const BoxNode& b = tree.nodes[node.first + 1];
    for (std::size_t k = 0; k < 3; ++k) {
      node.low_mm[k] = std::min(a.low_mm[k], b.low_mm[k]);
      node.high_mm[k] = std::max(a.high_mm[k], b.high_mm[k]);
    }
  }
}

/// Builds a tree by splits at the median of the longest side: its depth is the logarithm of the
/// count, for any mesh. REQUIRES finite vertices. Cost: 0.3 s for a million triangles.
BoxTree BuildBoxTree(const TriangleMesh& mesh) {
  constexpr std::size_t kMaxInLeaf = 4;
  BoxTree tree;
  std::vector<Centre> centres = CentresOf(mesh);
  struct Range {
    std::uint32_t node;
    std::size_t first;
    std::size_t last;
  };
  tree.nodes.reserve(centres.size());
  tree.nodes.emplace_back();
  std::vector<Range> open = {{0, 0, centres.size()}};
  while (!open.empty()) {
    const auto [node, first, last] = open.back();
    open.pop_back();
    if (last - first <= kMaxInLeaf) {
      tree.nodes[node].first = static_cast<std::uint32_t>(first);
      tree.nodes[node].triangles = static_cast<std::uint32_t>(last - first);
      continue;
    }
    const std::size_t side = LongestSide(centres, first, last);
    const std::size_t middle = (first + last) / 2;
    const auto at = [&](std::size_t i) { return centres.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last), [side](const Centre& a, const Centre& b) {
      return a.at_mm[side] < b.at_mm[side];
    });
    const auto child = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes[node].first = child;
    tree.nodes.resize(tree.nodes.size() + 2);
    open.push_back({child + 1, middle, last});
    open.push_back({child, first, middle});
  }
  tree.triangle.reserve(centres.size());
  for (const Centre& centre : centres) tree.triangle.push_back(centre.triangle);
  BoundAll(mesh, tree);
  return tree;
}

/// Computes a point's squared distance from a box; 0 inside.
double SquaredDistance(const BoxNode& node, const Eigen::Vector3d& p_mm) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double at = p_mm[static_cast<Eigen::Index>(i)];
    const double below = static_cast<double>(node.low_mm[i]) - at;
    const double above = at - static_cast<double>(node.high_mm[i]);
    const double off = below > above ? below : above;
    if (off > 0) sum += off * off;
  }
  return sum;
}

// Finds the nearest point of the edges, for a triangle without area.
NearestOnTriangle NearestOfEdges(const Vector3d& p, const std::array<Vector3d, 3>& corners) {
  NearestOnTriangle nearest{corners[0], kCorner0};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3d& from = corners[static_cast<std::size_t>(k)];
    const Vector3d along = corners[static_cast<std::size_t>((k + 1) % 3)] - from;
    const double length2 = along.squaredNorm();
    const double share = length2 > 0 ? (p - from).dot(along) / length2 : 0;
    auto feature = static_cast<TriangleFeature>(static_cast<int>(kEdge0) + k);
    if (share <= 0) feature = static_cast<TriangleFeature>(static_cast<int>(kCorner0) + k);
    if (share >= 1)
      feature = static_cast<TriangleFeature>(static_cast<int>(kCorner0) + (k + 1) % 3);
    const Vector3d at =
        share >= 1 ? Vector3d(from + along) : Vector3d(from + std::max(0.0, share) * along);
    const double distance2 = (p - at).squaredNorm();
    if (distance2 < least) {
      least = distance2;
      nearest = {at, feature};
    }
  }
  return nearest;
}

// Reorders vertices by the order of the leaves, without those that no triangle has.
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

NearestOnTriangle NearestPoint(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                               const Vector3d& c, bool flat) {
  if (flat) return NearestOfEdges(p, {a, b, c});
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d ap = p - a;
  const double ab_a = ab.dot(ap);
  const double ac_a = ac.dot(ap);
  if (ab_a <= 0 && ac_a <= 0) return {a, kCorner0};
  const Vector3d bp = p - b;
  const double ab_b = ab.dot(bp);
  const double ac_b = ac.dot(bp);
  if (ab_b >= 0 && ac_b <= ab_b) return {b, kCorner1};
  const double of_c = ab_a * ac_b - ab_b * ac_a;
  if (of_c <= 0 && ab_a >= 0 && ab_b <= 0) return {a + ab_a / (ab_a - ab_b) * ab, kEdge0};
  const Vector3d cp = p - c;
  const double ab_c = ab.dot(cp);
  const double ac_c = ac.dot(cp);
  if (ac_c >= 0 && ab_c <= ac_c) return {c, kCorner2};
  const double of_b = ab_c * ac_a - ab_a * ac_c;
  if (of_b <= 0 && ac_a >= 0 && ac_c <= 0) return {a + ac_a / (ac_a - ac_c) * ac, kEdge2};
  const double of_a = ab_b * ac_c - ab_c * ac_b;
  if (of_a <= 0 && ac_b - ab_b >= 0 && ab_c - ac_c >= 0) {
    return {b + (ac_b - ab_b) / (ac_b - ab_b + ab_c - ac_c) * (c - b), kEdge1};
  }
  const double all = of_a + of_b + of_c;
  return {a + of_b / all * ab + of_c / all * ac, kFace};
}

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
  double max_mm = 0;
  for (const Vector3d& at : mesh_.vertices_mm) max_mm = std::max(max_mm, at.cwiseAbs().maxCoeff());
  // 32-bit numbers do not determine a height below some of their roundings.
  const double min_height_mm = 4 * 6e-8 * max_mm;
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
    sliver_[t] = !(twice > min_height_mm * longest);
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
  // Within its rounding, the difference has no direction.
  const double rounding_mm = 1e-9 * (1 + p_mm.cwiseAbs().maxCoeff());
  if (distance > rounding_mm) result.outward = sign / distance * off;
  if (nearest.feature == TriangleFeature::kFace) result.outward = normals_[at];
  return result;
}

}  // namespace trammel::part_alignment
