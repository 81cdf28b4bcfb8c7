// A virtual casting and its CAD mesh, as a part fit is given them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit.h"
#include "sim/casting/casting.h"

namespace trammel {

struct CastingWorld {
  sim::Freeform part;
  sim::Casting casting;
  std::vector<Eigen::Vector3d> targets_mm;  ///< true positions in the ideal part
  part_alignment::PartFitInput input;
  part_alignment::PartFitOptions options;
};

/// Exact points, with a stated sigma whose guard is in traits.least_mm; four targets.
[[nodiscard]] CastingWorld MakeCastingWorld(const Eigen::Vector3d& half_mm,
                                            const sim::CastingTraits& traits, std::uint64_t seed);

/// Returns the result of ReadMeshFile for an STL of these facets; fails the test if it refuses.
[[nodiscard]] part_alignment::IdealSurface MeshSurface(const std::vector<sim::Facet>& facets,
                                                       double wanted_mm,
                                                       const std::string& unit = "mm");

/// Error of a placement from the best one: the maximum motion of a point of the casting, and the
/// turn.
struct PlacementError {
  double shift_mm = 0;  ///< of the casting's centre
  double turn_rad = 0;
};
[[nodiscard]] PlacementError ErrorOf(const CastingWorld& world, const part_alignment::PartFit& fit);

/// The exact stock allowances in the placement of a fit; no triangles.
[[nodiscard]] double LeastExactStock_mm(const CastingWorld& world,
                                        const part_alignment::PartFit& fit);

}  // namespace trammel
