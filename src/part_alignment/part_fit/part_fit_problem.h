// Part fit as the solver's problem: points on surfaces, and small motions.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit.h"

namespace trammel::part_alignment {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// ideal = rotation · measured + translation.
struct Motion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& x) const {
    return rotation * x + translation_mm;
  }
};

/// Point of a surface in the fit.
struct SurfaceContact {
  std::size_t point = 0;
  const IdealSurface* surface = nullptr;
  Eigen::Vector3d at_mm;  ///< scaled
  double min_mm = 0;
  double sigma_mm = 0;
  double weight = 1;
};

/// Contacts with surfaces. The surfaces must outlive it.
struct Problem {
  std::vector<SurfaceContact> contacts;
  double size_mm = 1;  ///< turns are measured by what they do to points so far from the middle
  bool has_mesh = false;
  double thickness_mm = 0;  ///< target thickness, not part of stock allowances
  double thickness_sigma_mm = 0;
};

/// Problem linearised for small motions about a placement: stock allowance (SmoothDistanceAt), and
/// its derivative by the motion (mm, and rotations about the points' middle in units of 1 / size).
struct Linear {
  Eigen::VectorXd stock_allowance_mm;
  Eigen::MatrixXd by_motion;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  /// Nearest triangle of each contact with a mesh, and whether its rim is nearest.
  std::vector<std::uint32_t> triangles = {};
  std::vector<std::uint8_t> at_rim = {};
};

/// Uses all processors if there are many contacts.
[[nodiscard]] Linear Linearise(const Problem& problem, const Motion& motion);

/// `motion` and then a step in Linear's coordinates.
[[nodiscard]] Motion Moved(const Motion& motion, const Linear& linear, const Vector6& step,
                           double size_mm);

/// Returns for every contact: its surface's wanted stock allowance, its weight, the least stock
/// allowance with its guard.
[[nodiscard]] Eigen::VectorXd Wanted(const Problem& problem);
[[nodiscard]] Eigen::VectorXd Weights(const Problem& problem);
[[nodiscard]] Eigen::VectorXd Least(const Problem& problem);

/// Computes the root mean square of stock allowance minus wanted; each surface weighs the same.
[[nodiscard]] double Uneven_mm(const Problem& problem, const Linear& linear);

/// Computes the scatter of stock allowance minus wanted about its mean: how well points fit the
/// surfaces, whatever the amount of stock.
[[nodiscard]] double Scatter_mm(const Problem& problem, const Linear& linear);

/// Selects at most `most` contacts, spread over their order.
[[nodiscard]] Problem Thinned(const Problem& problem, std::size_t most);

/// REQUIRES a checked input, which must outlive the problem.
[[nodiscard]] Problem ProblemOf(const PartFitInput& input, const PartFitOptions& options,
                                double scale);

/// Describes motions that change no stock allowance; empty if there are none. On triangles, changes
/// below the deviation of their normals from the smooth surface's count as none, so a cylinder of
/// facets is as free as a round one. `linear` is at the placement.
[[nodiscard]] std::string FreeMotions(const Problem& problem, const Linear& linear,
                                      const Motion& motion);

struct LeastDistance {
  Eigen::VectorXd point;
  std::vector<Eigen::Index> binding;  ///< rows that hold with equality and press on the point
};

/// Solves min |z| subject to rows z >= right (Lawson & Hanson 1974, chapter 23, by non-negative
/// least squares). Absent if no z satisfies all rows. Accuracy: constraints hold to 1e-9 of the
/// size of `right`.
[[nodiscard]] std::optional<LeastDistance> SolveLeastDistance(const Eigen::MatrixXd& rows,
                                                              const Eigen::VectorXd& right);

/// Fits to the wanted allowances, damped, ignoring the minimum stock allowance. On triangles, whose
/// normals jump, it ends when a round gains next to nothing.
[[nodiscard]] Motion FitSurfaces(const Problem& problem, Motion motion, int max_rounds = 240);

}  // namespace trammel::part_alignment
