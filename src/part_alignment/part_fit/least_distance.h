// The point nearest to the origin that satisfies linear inequalities.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace trammel::part_alignment {

struct LeastDistance {
  Eigen::VectorXd point;
  std::vector<Eigen::Index> binding;  ///< rows that hold with equality and press on the point
};

/// min |z| subject to rows z >= right (Lawson & Hanson 1974, chapter 23, by non-negative least
/// squares). Absent where no z satisfies all of them.
/// Accuracy: constraints hold to 1e-9 of the size of `right`.
[[nodiscard]] std::optional<LeastDistance> SolveLeastDistance(const Eigen::MatrixXd& rows,
                                                              const Eigen::VectorXd& right);

}  // namespace trammel::part_alignment
