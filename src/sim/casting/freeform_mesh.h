// A freeform part as a CAD program would export it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "sim/casting/freeform.h"

namespace trammel::sim {

/// Corners counter-clockwise seen from outside.
using Facet = std::array<Eigen::Vector3d, 3>;

/// 12 · steps² triangles with their corners on the surface, over the six sides of a cube.
[[nodiscard]] std::vector<Facet> FreeformFacets(const Freeform& part, int steps);

/// Of a box about the origin: 12 triangles.
[[nodiscard]] std::vector<Facet> BoxFacets(const Eigen::Vector3d& half_mm);

/// A cylinder about z of so many sides, closed above and below.
[[nodiscard]] std::vector<Facet> CylinderFacets(double radius_mm, double half_height_mm, int sides);

/// @param per_mm  units of the file in a mm
[[nodiscard]] std::string BinaryStl(const std::vector<Facet>& facets, double per_mm = 1);

}  // namespace trammel::sim
