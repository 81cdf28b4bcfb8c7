// Part of one smooth surface, known exactly.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trammel::sim {

/// Bump or dent of the surface about one direction.
struct FreeformBump {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitX();  ///< unit vector
  double height = 0;     ///< relative to the local radius, -0.3 … 0.3
  double sharpness = 4;  ///< the greater, the narrower
};

/// X(u) = half ∘ u · (1 + Σ height · exp(sharpness (u · towards - 1))) over all directions u.
struct Freeform {
  Eigen::Vector3d half_mm = {400, 250, 150};
  std::vector<FreeformBump> bumps;
};

/// Draws a part with six bumps, so that no rotation maps it to itself.
[[nodiscard]] Freeform DrawFreeform(const Eigen::Vector3d& half_mm, std::uint64_t seed);

/// @param u  of length 1
[[nodiscard]] Eigen::Vector3d SurfacePoint(const Freeform& part, const Eigen::Vector3d& u);

/// Returns the outward unit normal, from the exact derivatives.
[[nodiscard]] Eigen::Vector3d SurfaceNormal(const Freeform& part, const Eigen::Vector3d& u);

/// Computes the height of a place above the surface, along the normal of the nearest point, found
/// by iteration to 1e-10 mm. REQUIRES a place nearer than the surface's least radius of curvature.
[[nodiscard]] double StockAt(const Freeform& part, const Eigen::Vector3d& at_mm);

struct CastingTraits {
  int points = 10'000;    ///< spread evenly over all directions
  double wanted_mm = 3;   ///< stock allowance that is aimed at
  double min_mm = 0.5;    ///< minimum at every point, including the guard
  double waves_mm = 0.5;  ///< undulation of the stock
  int dents = 3;  ///< points with just the least, on which the best placement rests; 0 … 6
  double pressing_mm = 0.02;  ///< how hard it rests on each, as a shift of all stock
  /// Stock allowance missing everywhere: no feasible placement exists, and this is the minimum
  /// shortage.
  std::optional<double> missing_mm;
  /// Lower limit of u · z of the directions seen, -1 … 1.
  double seen_from_z = -1;
};

/// ideal = rotation · measured + translation.
struct Casting {
  std::vector<Eigen::Vector3d> ideal_mm;
  std::vector<Eigen::Vector3d> measured_mm;
  std::vector<double> stock_mm;  ///< at the best placement
  std::vector<bool> dent;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
};

/// Draws points on the exact surface's normals. The stock is chosen such that the intended
/// placement satisfies the Karush-Kuhn-Tucker conditions of the least squares to `wanted_mm` under
/// `least_mm`: small motions of it are worse or violate the minimum.
[[nodiscard]] Casting DrawCasting(const Freeform& part, const CastingTraits& traits,
                                  std::uint64_t seed);

/// Corners counter-clockwise seen from outside.
using Facet = std::array<Eigen::Vector3d, 3>;

/// Returns 12 · steps² triangles with their corners on the surface, over the six sides of a cube.
[[nodiscard]] std::vector<Facet> FreeformFacets(const Freeform& part, int steps);

/// @param per_mm  units of the file in a mm
[[nodiscard]] std::string BinaryStl(const std::vector<Facet>& facets, double per_mm = 1);

}  // namespace trammel::sim
