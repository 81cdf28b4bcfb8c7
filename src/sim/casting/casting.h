// A raw part about a freeform one, of which the best placement is known.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/casting/freeform.h"

namespace trammel::sim {

struct CastingTraits {
  int points = 10'000;    ///< spread evenly over all directions
  double wanted_mm = 3;   ///< stock allowance that is aimed at
  double least_mm = 0.5;  ///< that a point must have, guard and all
  double waves_mm = 0.5;  ///< how much the stock undulates
  int dents = 3;  ///< points with just the least, on which the best placement rests; 0 … 6
  double pressing_mm = 0.02;  ///< how hard it rests on each, as a shift of all stock
  /// Stock allowance missing everywhere: no placement exists, and this is how much it lacks at
  /// best.
  std::optional<double> missing_mm;
  /// Only directions with u · z above this, -1 … 1.
  double seen_from_z = -1;
};

/// ideal = rotation · measured + translation.
struct Casting {
  std::vector<Eigen::Vector3d> ideal_mm;
  std::vector<Eigen::Vector3d> measured_mm;
  std::vector<double> stock_mm;  ///< in the best placement
  std::vector<bool> dent;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
};

/// Points on the exact surface's normals. The stock is such that the placement in which it is meant
/// satisfies the conditions of Karush, Kuhn and Tucker of the least squares to `wanted_mm` under
/// `least_mm`: small motions of it are worse or take too much.
[[nodiscard]] Casting DrawCasting(const Freeform& part, const CastingTraits& traits,
                                  std::uint64_t seed);

}  // namespace trammel::sim
