// Fit of the ideal part in a raw one: stock allowance everywhere, and as even as possible.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/rejection.h"
#include "base/result.h"
#include "geometry/euler.h"
#include "part_alignment/mesh/mesh_distance.h"

namespace trammel::part_alignment {

/// Point measured out of the machine, in that measurement's own frame.
struct MeasuredPoint {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  ///< per axis, k = 1
  /// Ideal surface to be machined there; empty for a coded target or a bar's end.
  std::string surface;
};

enum class SurfaceKind { kPlane, kShaft, kBore, kMesh };

/// Surface of the ideal part, in its frame.
struct IdealSurface {
  std::string id;
  SurfaceKind kind = SurfaceKind::kPlane;
  /// Approximate middle of the region: on the plane, or on the cylinder's axis.
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  /// Outward normal of a plane, axis of a cylinder; of any length.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double radius_mm = 0;           ///< shafts and bores only
  double stock_allowance_mm = 0;  ///< wanted
  /// Mesh of a kMesh surface, which has neither middle nor direction.
  std::shared_ptr<const MeshDistance> mesh = {};
  /// Upper limit of the triangles' error under the points, > 0; coarser triangles make the verdict
  /// cannot_tell.
  std::optional<double> max_facet_error_mm = {};
};

/// Scale bar: two points at a calibrated distance.
struct ScaleBar {
  std::string from;
  std::string to;
  double length_mm = 0;
  double sigma_mm = 0;
};

struct PartFitInput {
  std::vector<MeasuredPoint> points;
  std::vector<IdealSurface> surfaces;
  std::vector<ScaleBar> bars;
  /// Approximate ideal_from_measured. Absent: from the middles of the surfaces' points.
  std::optional<geometry::Pose> start;
};

struct PartFitOptions {
  double min_stock_allowance_mm = 0;
  /// Height of the targets' measured faces over the surfaces that they are stuck to: subtracted
  /// along the normals. 0 for points of the surfaces themselves; up to 10.
  double target_thickness_mm = 0;
  double target_thickness_sigma_mm = 0;  ///< k = 1, the same error in all of them
  /// Number of the point's sigmas by which stock allowance must exceed its minimum.
  double guard_sigmas = 2;
  /// Upper limit of |scale - 1|; beyond it something other than scale is wrong.
  double max_scale_change = 1e-3;
  /// Upper limit of unevenness (root mean square); beyond it the points are not this part's. Taken
  /// of all points on meshes about their mean, of those of each other surface about the wanted
  /// allowance. Absent: the wanted stock allowance or, where that is more, a fiftieth of the mesh's
  /// diameter or, for planes, of the points' extent, and a third of a shaft's or bore's radius.
  std::optional<double> max_uneven_mm;
};

struct PointStockAllowance {
  std::size_t point = 0;  ///< index into the input
  double stock_allowance_mm = 0;
  double wanted_mm = 0;
  double min_mm = 0;     ///< including the guard
  bool binding = false;  ///< the placement rests on it
  /// Surface normal at its point nearest to the measured one, in the ideal part's frame.
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
};

struct FittedTarget {
  std::string id;
  Eigen::Vector3d ideal_mm = Eigen::Vector3d::Zero();
};

/// All but the stock allowances is valid only with verdict good.
struct PartFit {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  std::vector<std::string> unchecked;  ///< assumptions of the answer, whatever the verdict
  geometry::Pose ideal_from_measured;  ///< after the scale
  double scale = 1;
  double scale_sigma = 0;
  AdjustmentCheck check;  ///< points with a surface
  std::vector<PointStockAllowance>
      stock_allowances;  ///< points with a surface; best placement if refused
  double min_mm = 0;
  double mean_mm = 0;
  double uneven_mm = 0;  ///< root mean square of stock allowance less wanted, each surface alike
  /// Largest deviation, to either side, of the triangles under the points from the true surface; of
  /// meshes with lifts, the remainder. 0 without a mesh.
  double facet_error_mm = 0;
  std::vector<FittedTarget> targets;  ///< points without a surface
  /// (3 · targets)², mm²: their own uncertainty, the scale's and the placement's.
  Eigen::MatrixXd covariance;
  std::vector<std::string> notices;
};

/// Finds the placement whose stock allowance differs least from the wanted one (least squares; each
/// surface weighs the same however many points it has), among all that keep the minimum stock
/// allowance at every point. Convex for small motions: a least-distance problem (Lawson & Hanson
/// 1974), repeated until the placement converges.
/// Verdicts other than good: no placement leaves material everywhere (refused; reports how much is
/// missing at best, and where), surfaces that leave a motion free, a direction turned round, a
/// point far beside its surface (cannot_tell), scale bars that contradict one another or require
/// too large a scale (refused), points off their surfaces (refused).
/// Of meshes the stock allowance is the distance from the nearest triangle. The possible bulge of a
/// smooth surface out of that triangle (FacetErrorOf) is added to the point's guard and sigma.
/// Without `start` all rotations are searched. Further verdicts: a mesh of another size than the
/// points, or points off it (refused); placements of equal fit, a start beside a better one,
/// triangles coarser than allowed, points beyond the rim of an open shell (cannot_tell).
/// Errors (kInput): ids twice or unknown, invalid numbers, a surface without points.
[[nodiscard]] Result<PartFit> FitPart(const PartFitInput& input, const PartFitOptions& options);

}  // namespace trammel::part_alignment
