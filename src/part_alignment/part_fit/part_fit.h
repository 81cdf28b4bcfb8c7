// Where the ideal part lies in a raw one: stock allowance everywhere, and as even as can be.
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

/// A point measured out of the machine, in that measurement's own frame.
struct MeasuredPoint {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  ///< per axis, k = 1
  /// The ideal surface that is to be machined there; empty for a coded target or a bar's end.
  std::string surface;
};

enum class SurfaceKind { kPlane, kShaft, kBore, kMesh };

/// A surface of the ideal part, in its frame.
struct IdealSurface {
  std::string id;
  SurfaceKind kind = SurfaceKind::kPlane;
  /// About the middle of the region: on the plane, or on the cylinder's axis.
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  /// A plane's outward normal, a cylinder's axis; of any length.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double radius_mm = 0;           ///< of shaft and bore
  double stock_allowance_mm = 0;  ///< wanted
  /// Of kMesh, which has neither middle nor direction.
  std::shared_ptr<const MeshDistance> mesh = {};
  /// Coarser triangles under the points leave the answer open, > 0.
  std::optional<double> most_facet_error_mm = {};
};

/// Two points whose distance is calibrated.
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
  /// ideal_from_measured, roughly. Absent: from the middles of the surfaces' points.
  std::optional<geometry::Pose> start;
};

struct PartFitOptions {
  double least_stock_allowance_mm = 0;
  /// How far the targets' faces, which were measured, stand off the surfaces that they are stuck
  /// to: subtracted along the normals. 0 for points of the surfaces themselves; up to 10.
  double target_thickness_mm = 0;
  double target_thickness_sigma_mm = 0;  ///< k = 1, the same error in all of them
  /// StockAllowance must exceed the least by so many of the point's sigmas.
  double guard_sigmas = 2;
  /// Scales farther from 1 are no matter of scale.
  double most_scale_change = 1e-3;
  /// Points that stand out more unevenly (root mean square) are not this part's: all points on
  /// meshes about their mean, those of each other surface about what is wanted there. Absent: the
  /// wanted stock allowance or, where that is more, a fiftieth of the mesh's diameter or, for
  /// planes, of the points' extent, and a third of a shaft's or bore's radius.
  std::optional<double> most_uneven_mm;
};

struct PointStockAllowance {
  std::size_t point = 0;  ///< index into the input
  double stock_allowance_mm = 0;
  double wanted_mm = 0;
  double least_mm = 0;   ///< with the guard
  bool binding = false;  ///< the placement rests on it
  /// The surface's normal where the point is nearest to it, in the ideal part's frame.
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
};

struct FittedTarget {
  std::string id;
  Eigen::Vector3d ideal_mm = Eigen::Vector3d::Zero();
};

/// Everything but stock allowances is meant only with verdict good.
struct PartFit {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  std::vector<std::string> unchecked;  ///< that the answer rests on, whatever the verdict
  geometry::Pose ideal_from_measured;  ///< after the scale
  double scale = 1;
  double scale_sigma = 0;
  AdjustmentCheck check;  ///< of the points with a surface
  std::vector<PointStockAllowance>
      stock_allowances;  ///< of points with a surface; best placement if refused
  double least_mm = 0;
  double mean_mm = 0;
  double uneven_mm = 0;  ///< root mean square of stock allowance less wanted, each surface alike
  /// How far the triangles under the points may be from the surface that they stand for: the most
  /// to either side; of meshes with lifts, what these leave of it. 0 without a mesh.
  double facet_error_mm = 0;
  std::vector<FittedTarget> targets;  ///< points without a surface
  /// (3 · targets)², mm²: their own uncertainty, the scale's and the placement's.
  Eigen::MatrixXd covariance;
  std::vector<std::string> notices;
};

/// Among all placements that leave at least the least stock allowance at every point, the one whose
/// stock allowance differs least from what is wanted (least squares; each surface weighs the same
/// however many points it has). Convex for small motions: a least-distance problem (Lawson & Hanson
/// 1974), repeated until the placement rests. Verdicts other than good: no placement leaves
/// material everywhere (refused; says how much is missing at best, and where), surfaces that leave
/// a motion free, a direction turned round, a point far beside its surface (cannot_tell), scale
/// bars that contradict one another or ask for too large a scale (refused), points that do not lie
/// on their surfaces (refused).
/// Of meshes the stock allowance is the distance from the nearest triangle, and what a smooth
/// surface may bulge out of that one (FacetErrorOf) joins the point's guard and sigma. Without
/// `start` the placement is searched among all rotations. Verdicts besides: a mesh of another size
/// than the points, or points that do not lie on it (refused); placements that fit alike, a start
/// beside a better one, triangles coarser than asked for, points beyond the rim of an open shell
/// (cannot_tell).
/// Errors (kInput): ids twice or unknown, numbers that cannot be, a surface without points.
[[nodiscard]] Result<PartFit> FitPart(const PartFitInput& input, const PartFitOptions& options);

}  // namespace trammel::part_alignment
