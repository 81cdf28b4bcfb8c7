// Computes possible views, their information, and the views that determine a weak direction.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// View not taken yet. information is the J^T W J that it would add, in UnitsPerMillimetre.
struct CandidateView {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::size_t aimed_at = 0;       ///< index of the target
  std::vector<std::size_t> seen;  ///< indices of all targets in the picture
  ThetaMatrix information;
};

struct CandidateOptions {
  double distance_mm = 300;  ///< camera origin to target, along its axis
  double field_share = 0.8;  ///< usable share of the picture's width and height, about its centre
  double sigma_px = 0.05;
  std::vector<Eigen::Matrix3d> orientations;  ///< spindle orientations
};

/// Computes candidates for all targets, all orientations and nine places of the target in the
/// picture: its centre, the sides and the corners of the field.
/// @param problem  camera and unknowns; its observations only scale the unknowns.
/// @param theta    of the problem, as are the targets' coordinates (the same frame).
/// @param units    UnitsPerMillimetre.
[[nodiscard]] std::vector<CandidateView> CandidateViews(
    const PoseProblem& problem, const Theta& theta, const Theta& units,
    const std::vector<Eigen::Vector3d>& targets_mm, const CandidateOptions& options);

/// Computes the standard uncertainty (mm) along the weakest direction of an information matrix in
/// UnitsPerMillimetre; at most 1e6.
[[nodiscard]] double WeakestSigma(const ThetaMatrix& information);

/// Computes the logarithm of the determinant. A slight information about everything (1 m, k = 1) is
/// added, to rank plans below full rank too.
[[nodiscard]] double LogDeterminant(const ThetaMatrix& information);

/// Advises up to four views, each the one that improves the weakest direction most, until its
/// uncertainty is within `limit_mm`. Uses the distances and orientations so far; if needed, also
/// turned about the spindle's axis or farther away. In words, with spindle positions.
/// @param theta  solution of the observations, however little they determine it.
[[nodiscard]] std::string AdviseViews(const PoseProblem& problem, const Theta& theta,
                                      const std::vector<PartTarget>& targets, double limit_mm);

}  // namespace trammel::part_alignment
