#include "part_alignment/mesh/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::part_alignment {
namespace {

using Three = std::array<float, 3>;

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

// Children stand behind their parents.
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

}  // namespace

BoxTree BuildBoxTree(const TriangleMesh& mesh) {
  constexpr std::size_t kMostInLeaf = 4;
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
    if (last - first <= kMostInLeaf) {
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

}  // namespace trammel::part_alignment
