#include "tool_offset/offset/leg_play.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "tool_offset/offset/sheet_model.h"

namespace trammel::tool_offset {
namespace {

/// Less likely than this by chance: a contradiction, which widens the intervals.
constexpr double kContradiction = 0.01;

/// The mean distance of a comb's legs beyond the planned one.
struct CombSpacing {
  std::pair<int, Axis> of;  ///< tool and axis: what shares a line's shape
  SheetPoint play;          ///< per mm of each axis' play
  double mean_mm = 0;
  double squares_mm2 = 0;  ///< about the mean
  int count = 0;
};

std::vector<CombSpacing> SpacingsOf(const SheetPlan& plan,
                                    const std::vector<StructureReading>& structures) {
  constexpr int kFewest = 4;
  std::vector<CombSpacing> combs;
  for (const StructureReading& reading : structures) {
    if (!reading.offset_mm.good()) continue;
    const Structure& structure = plan.structures[reading.structure];
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      std::vector<double> beyond_mm;
      for (const FingerReading& finger : reading.fingers) {
        if (finger.comb != comb || !finger.left_out.empty()) continue;
        const double apart_mm = finger.legs[1].position_mm - finger.legs[0].position_mm;
        beyond_mm.push_back(apart_mm / (1 + reading.stretch) - plan.settings.leg_spacing_mm);
      }
      if (static_cast<int>(beyond_mm.size()) < kFewest) continue;
      CombSpacing spacing;
      spacing.of = {structure.combs[comb].tool, structure.axis};
      const auto legs = FingerLegs(plan, structure, comb, 1);
      const SheetPoint lower = PlayAlong(plan, structure, legs[0]);
      const SheetPoint upper = PlayAlong(plan, structure, legs[1]);
      spacing.play = {upper.u_mm - lower.u_mm, upper.v_mm - lower.v_mm};
      spacing.mean_mm = Mean(beyond_mm);
      for (const double mm : beyond_mm) spacing.squares_mm2 += std::pow(mm - spacing.mean_mm, 2);
      spacing.count = static_cast<int>(beyond_mm.size());
      combs.push_back(spacing);
    }
  }
  return combs;
}

/// Variance of each comb's mean: its tool's scatter, pooled.
Eigen::VectorXd Variances(const std::vector<CombSpacing>& combs, double& freedom) {
  constexpr double kLeast_mm2 = 1e-12;  // 1 nm: a drawn page without noise
  std::map<int, std::pair<double, double>> pooled;
  freedom = 0;
  for (const CombSpacing& comb : combs) {
    pooled[comb.of.first].first += comb.squares_mm2;
    pooled[comb.of.first].second += comb.count - 1;
    freedom += comb.count - 1;
  }
  Eigen::VectorXd variance(static_cast<Eigen::Index>(combs.size()));
  for (std::size_t i = 0; i < combs.size(); ++i) {
    const auto& [squares, degrees] = pooled[combs[i].of.first];
    variance[static_cast<Eigen::Index>(i)] =
        std::max(kLeast_mm2, squares / degrees) / combs[i].count;
  }
  return variance;
}

}  // namespace

PlayOfLegs EstimatePlayOfLegs(const SheetPlan& plan,
                              const std::vector<StructureReading>& structures) {
  const std::vector<CombSpacing> combs = SpacingsOf(plan, structures);
  if (combs.empty()) return {};
  std::map<std::pair<int, Axis>, Eigen::Index> column;
  for (const CombSpacing& comb : combs) {
    column.emplace(comb.of, static_cast<Eigen::Index>(column.size()) + 2);
  }
  const auto rows = static_cast<Eigen::Index>(combs.size());
  const auto columns = static_cast<Eigen::Index>(column.size()) + 2;
  double degrees = 0;
  const Eigen::VectorXd variance = Variances(combs, degrees);
  const Eigen::VectorXd root = variance.cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd y(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const CombSpacing& comb = combs[static_cast<std::size_t>(i)];
    design(i, 0) = comb.play.u_mm;
    design(i, 1) = comb.play.v_mm;
    design(i, column.at(comb.of)) = 1;
    y[i] = comb.mean_mm;
  }
  const double scale = root.maxCoeff();
  const Eigen::MatrixXd weighted = (root / scale).asDiagonal() * design;
  const geometry::SingularValues of = geometry::DecomposeSingular(weighted.transpose() * weighted);
  const auto rank = (of.values.array() > 1e-9 * of.values.maxCoeff()).count();
  const Eigen::MatrixXd known = of.v.leftCols(rank);
  const Eigen::MatrixXd unknowable = of.v.rightCols(columns - rank);
  const Eigen::MatrixXd inverse =
      known * of.values.head(rank).cwiseInverse().asDiagonal() * known.transpose();
  const Eigen::VectorXd solution =
      inverse * weighted.transpose() * ((root / scale).cwiseProduct(y));
  const double chi_square = root.cwiseProduct(y - design * solution).squaredNorm();
  const auto freedom = static_cast<int>(rows - rank);
  const bool widened = freedom > 0 && ChiSquareTail(chi_square, freedom) < kContradiction;
  const double widening = widened ? chi_square / freedom : 1;
  const auto answer = [&](Eigen::Index axis) -> std::optional<Quantity> {
    constexpr double kDetermined = 1e-6;
    const bool determined = rank == columns || unknowable.row(axis).norm() <= kDetermined;
    if (!determined) return std::nullopt;
    Quantity play;
    play.value = solution[axis];
    play.standard_uncertainty = std::sqrt(widening * inverse(axis, axis)) / scale;
    const double half =
        StudentT95(widened ? freedom : std::max(1.0, degrees)) * play.standard_uncertainty;
    play.interval95 = {play.value - half, play.value + half};
    return play;
  };
  return {answer(0), answer(1)};
}

}  // namespace trammel::tool_offset
