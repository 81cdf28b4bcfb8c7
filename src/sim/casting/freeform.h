// A part of one smooth surface, known exactly.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace trammel::sim {

/// Swells or dents the surface about one direction.
struct FreeformBump {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitX();  ///< of length 1
  double height = 0;                                   ///< of the radius there, -0.3 … 0.3
  double sharpness = 4;                                ///< the greater, the narrower
};

/// X(u) = half ∘ u · (1 + Σ height · exp(sharpness (u · towards - 1))) over all directions u.
struct Freeform {
  Eigen::Vector3d half_mm = {400, 250, 150};
  std::vector<FreeformBump> bumps;
};

/// Six bumps drawn, so that no rotation takes the part to itself.
[[nodiscard]] Freeform DrawFreeform(const Eigen::Vector3d& half_mm, std::uint64_t seed);

/// @param u  of length 1
[[nodiscard]] Eigen::Vector3d SurfacePoint(const Freeform& part, const Eigen::Vector3d& u);

/// Outward, of length 1, from the exact derivatives.
[[nodiscard]] Eigen::Vector3d SurfaceNormal(const Freeform& part, const Eigen::Vector3d& u);

/// How far a place stands out of the surface: along the normal of the place nearest to it, found by
/// iteration to 1e-10 mm. REQUIRES a place nearer than the surface's least radius of curvature.
[[nodiscard]] double StockAt(const Freeform& part, const Eigen::Vector3d& at_mm);

}  // namespace trammel::sim
