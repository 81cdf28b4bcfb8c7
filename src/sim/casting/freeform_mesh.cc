#include "sim/casting/freeform_mesh.h"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace trammel::sim {
namespace {

using Eigen::Vector3d;

void PutWord(std::string& bytes, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>((word >> (8 * i)) & 0xffU));
}

void PutVector(std::string& bytes, const Vector3d& v) {
  for (const double x : v) PutWord(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
}

Vector3d FacetNormal(const Facet& facet) {
  const Vector3d cross = (facet[1] - facet[0]).cross(facet[2] - facet[0]);
  return cross.norm() > 0 ? Vector3d(cross.normalized()) : Vector3d::Zero();
}

}  // namespace

std::vector<Facet> FreeformFacets(const Freeform& part, int steps) {
  std::vector<Facet> facets;
  facets.reserve(12U * static_cast<std::size_t>(steps) * static_cast<std::size_t>(steps));
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      // The same whole numbers at an edge of the cube from either of its sides: the same corner.
      const auto corner = [&](int i, int j) {
        Vector3d u;
        u[axis] = side * steps;
        u[(axis + 1) % 3] = 2 * i - steps;
        u[(axis + 2) % 3] = 2 * j - steps;
        return SurfacePoint(part, u.normalized());
      };
      for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < steps; ++j) {
          const Vector3d a = corner(i, j);
          const Vector3d b = corner(i + 1, j);
          const Vector3d c = corner(i + 1, j + 1);
          const Vector3d d = corner(i, j + 1);
          const bool rising = (i + j) % 2 == 0;
          Facet first = rising ? Facet{a, b, c} : Facet{a, b, d};
          Facet second = rising ? Facet{a, c, d} : Facet{b, c, d};
          if (side < 0) {
            std::swap(first[1], first[2]);
            std::swap(second[1], second[2]);
          }
          facets.push_back(first);
          facets.push_back(second);
        }
      }
    }
  }
  return facets;
}

std::vector<Facet> BoxFacets(const Vector3d& half_mm) {
  std::vector<Facet> facets;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const auto corner = [&](int i, int j) {
        Vector3d at;
        at[axis] = side * half_mm[axis];
        at[(axis + 1) % 3] = i * half_mm[(axis + 1) % 3];
        at[(axis + 2) % 3] = j * half_mm[(axis + 2) % 3];
        return at;
      };
      Facet first = {corner(-1, -1), corner(1, -1), corner(1, 1)};
      Facet second = {corner(-1, -1), corner(1, 1), corner(-1, 1)};
      if (side < 0) {
        std::swap(first[1], first[2]);
        std::swap(second[1], second[2]);
      }
      facets.push_back(first);
      facets.push_back(second);
    }
  }
  return facets;
}

std::vector<Facet> CylinderFacets(double radius_mm, double half_height_mm, int sides) {
  std::vector<Facet> facets;
  const auto rim = [&](int i, double z) {
    const double angle = 2 * std::numbers::pi * (i % sides) / sides;
    return Vector3d(radius_mm * std::cos(angle), radius_mm * std::sin(angle), z);
  };
  const double h = half_height_mm;
  for (int i = 0; i < sides; ++i) {
    facets.push_back({rim(i, -h), rim(i + 1, -h), rim(i + 1, h)});
    facets.push_back({rim(i, -h), rim(i + 1, h), rim(i, h)});
    facets.push_back({Vector3d(0, 0, h), rim(i, h), rim(i + 1, h)});
    facets.push_back({Vector3d(0, 0, -h), rim(i + 1, -h), rim(i, -h)});
  }
  return facets;
}

std::string BinaryStl(const std::vector<Facet>& facets, double per_mm) {
  std::string bytes(80, ' ');
  bytes.reserve(84 + 50 * facets.size());
  PutWord(bytes, static_cast<std::uint32_t>(facets.size()));
  for (const Facet& facet : facets) {
    PutVector(bytes, FacetNormal(facet));
    for (const Vector3d& corner : facet) PutVector(bytes, per_mm * corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace trammel::sim
