// Normal equations of an adjustment by stations, with each station's own unknowns eliminated.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace trammel::part_alignment {

/// Returns the matrix of v × x: the negative derivative of a rotated point by the rotation.
[[nodiscard]] Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

/// Normal equations of unknowns that stations share (points, lens, machine) and a few of each
/// station's own.
struct NormalEquations {
  struct Station {
    std::size_t station = 0;
    std::vector<Eigen::Index> unknowns;  ///< shared ones that its observations meet, ascending
    Eigen::MatrixXd coupling;            ///< unknowns × own
    Eigen::MatrixXd block;               ///< own × own
    Eigen::VectorXd right;
  };
  Eigen::MatrixXd matrix;         ///< shared unknowns, before the elimination
  Eigen::VectorXd right;          ///< the gradient's negative, likewise
  std::vector<Station> stations;  ///< those with observations
};

/// One observation, whitened: projected minus observed.
struct ObservationRow {
  std::vector<Eigen::Index> unknowns;  ///< shared ones, none twice
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_shared;
  Eigen::Matrix<double, 2, Eigen::Dynamic> by_own;
  Eigen::Vector2d residual;
};

/// Adds a station with its observations; `normal` is sized beforehand. REQUIRES a row.
void AddStation(std::size_t station, const std::vector<ObservationRow>& rows,
                NormalEquations& normal);

/// Replaces the rows of held unknowns, and of those without observations, by rows of the identity.
/// @param held  of the first shared unknowns
void HoldUnknowns(const std::vector<bool>& held, NormalEquations& normal);

/// Matrix and right side with every station eliminated. Before that, `damping` raises the diagonals
/// by this share of themselves.
struct ReducedNormal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};
[[nodiscard]] ReducedNormal Reduce(const NormalEquations& normal, double damping);

struct NormalStep {
  Eigen::VectorXd shared;
  std::vector<Eigen::VectorXd> stations;  ///< like NormalEquations::stations
  double decrement = 0;                   ///< of the cost, by the linear model
};
/// @param motions  orthonormal columns: changes of the shared unknowns that no observation notices,
///                 which the step leaves out (inner constraints). None: the matrix is regular.
[[nodiscard]] NormalStep Solve(const NormalEquations& normal, const Eigen::MatrixXd& motions,
                               double damping);

/// Computes the inverse of a positive matrix whose rows differ in unit, scaled to a unit diagonal
/// meanwhile. If there is none, `determined` becomes false and the result 0.
[[nodiscard]] Eigen::MatrixXd ScaledInverse(const Eigen::MatrixXd& matrix, bool& determined);

/// Covariance of one station and the shared unknowns of its observations.
struct StationCovariance {
  Eigen::MatrixXd own;     ///< own × own
  Eigen::MatrixXd with;    ///< own × unknowns
  Eigen::MatrixXd within;  ///< covariance of unknowns
};
/// @param shared  covariance of all shared unknowns
[[nodiscard]] StationCovariance CovarianceOf(const NormalEquations::Station& station,
                                             const Eigen::MatrixXd& shared, bool& determined);

/// Computes J Q Jᵀ of one of the station's observations: the amount by which its residual's
/// variance is below 1.
[[nodiscard]] Eigen::Matrix2d FittedCovariance(const ObservationRow& row,
                                               const NormalEquations::Station& station,
                                               const StationCovariance& covariance);

}  // namespace trammel::part_alignment
