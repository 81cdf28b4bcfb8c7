// Small meshes that tests make by hand.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "part_alignment/mesh/mesh_distance.h"
#include "part_alignment/mesh/solid_mesh.h"

namespace trammel::part_alignment::test {

/// Twelve triangles, outwards, about a place.
inline TriangleMesh BoxMesh(const Eigen::Vector3d& half_mm,
                            const Eigen::Vector3d& middle_mm = Eigen::Vector3d::Zero()) {
  TriangleMesh mesh;
  for (int v = 0; v < 8; ++v) {
    const Eigen::Vector3d sign((v & 1) != 0 ? 1 : -1, (v & 2) != 0 ? 1 : -1, (v & 4) != 0 ? 1 : -1);
    mesh.vertices_mm.emplace_back(middle_mm + half_mm.cwiseProduct(sign));
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

/// Adds a mesh's triangles, with vertices of their own.
inline void Append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_mm.size());
  mesh.vertices_mm.insert(mesh.vertices_mm.end(), other.vertices_mm.begin(),
                          other.vertices_mm.end());
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// A prism along y over an outline of x and z, whose first corner sees all others.
inline TriangleMesh PrismMesh(const std::vector<Eigen::Vector2d>& outline, double half_mm) {
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {-half_mm, half_mm}) {
    for (const auto& at : outline) mesh.vertices_mm.emplace_back(at.x(), y, at.y());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, n + j, j});
    mesh.triangles.push_back({i, n + i, n + j});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i, i + 1});
    mesh.triangles.push_back({n, n + i + 1, n + i});
  }
  return mesh;
}

/// A surface of revolution about z of radius(angle) at height(angle), angle from 0 (the upper pole)
/// to pi, twice as many sectors as rings.
template <class Profile>
TriangleMesh RoundMesh(int rings, const Profile& profile) {
  TriangleMesh mesh;
  const int sectors = 2 * rings;
  const auto add = [&](double polar, double turn) {
    const auto [radius, height] = profile(polar);
    mesh.vertices_mm.emplace_back(radius * std::cos(turn), radius * std::sin(turn), height);
  };
  add(0, 0);
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      add(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / sectors);
    }
  }
  add(std::numbers::pi, 0);
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(1 + (i - 1) * sectors + j % sectors);
  };
  const auto last = static_cast<std::uint32_t>(mesh.vertices_mm.size() - 1);
  for (int j = 0; j < sectors; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    mesh.triangles.push_back({last, at(rings - 1, j + 1), at(rings - 1, j)});
    for (int i = 1; i + 1 < rings; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

inline TriangleMesh SphereMesh(double radius_mm, int rings) {
  return RoundMesh(rings, [radius_mm](double polar) {
    return std::pair{radius_mm * std::sin(polar), radius_mm * std::cos(polar)};
  });
}

}  // namespace trammel::part_alignment::test
