#include "tool_offset/reading/comb_fit.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::tool_offset {
namespace {

constexpr int kFewestTeeth = 4;

/// Legendre polynomials 0 … degree at x in [-1, 1].
Eigen::RowVectorXd Legendre(double x, int degree) {
  Eigen::RowVectorXd p(degree + 1);
  p[0] = 1;
  if (degree > 0) p[1] = x;
  for (int n = 1; n < degree; ++n) p[n + 1] = ((2 * n + 1) * x * p[n] - n * p[n - 1]) / (n + 1);
  return p;
}

/// Enough for the shortest wrinkle over the comb's length, few enough for the fingers.
int Degree(const SheetSettings& settings, int fingers) {
  constexpr double kShortestWrinkle_mm = 40;
  constexpr int kBeyond = 5;  // orders until a wrinkle's share falls below a hundredth
  const double periods = settings.teeth * settings.pitch_mm / kShortestWrinkle_mm;
  const int wanted = static_cast<int>(std::ceil(std::numbers::pi * periods)) + kBeyond;
  return std::clamp(std::min(wanted, fingers / 3), 1, 40);
}

/// A fit to the fingers that count.
struct Fit {
  std::vector<FingerReading*> used;
  Eigen::VectorXd residual;
  Eigen::VectorXd leverage;
  Eigen::VectorXd influence;  ///< of each finger on the offset
  double offset_mm = 0;
  double stretch = 0;
  double growth = 0;  ///< of the displacement per mm, where it may grow
  Eigen::VectorXd growth_influence;
};

Fit FitOnce(const SheetSettings& settings, StructureReading& structure) {
  Fit fit;
  for (FingerReading& finger : structure.fingers) {
    if (finger.left_out.empty()) fit.used.push_back(&finger);
  }
  const auto count = static_cast<Eigen::Index>(fit.used.size());
  const int degree = Degree(settings, static_cast<int>(count));
  const double half_mm = settings.teeth * settings.pitch_mm / 2;
  const bool grows = structure.lever.has_value();
  const Eigen::Index last = degree + (grows ? 2 : 1);
  Eigen::MatrixXd design(count, last + 1);
  Eigen::VectorXd y(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const FingerReading& finger = *fit.used[static_cast<std::size_t>(i)];
    design.row(i).head(degree + 1) = Legendre(finger.planned_mm / half_mm, degree);
    design(i, last) = finger.comb == 1 ? 0.5 : -0.5;
    if (grows) design(i, last - 1) = design(i, last) * finger.planned_mm / half_mm;
    y[i] = finger.position_mm;
  }
  const auto [q, r] = geometry::DecomposeOrthogonal(design);
  const Eigen::VectorXd solution = geometry::SolveUpper(r, q.transpose() * y);
  fit.residual = y - design * solution;
  fit.leverage = q.rowwise().squaredNorm();
  // The offset is the last unknown: its row of the inverse of R is 1 / r in the last place.
  fit.influence = q.col(last) / r(last, last);
  fit.offset_mm = solution[last];
  if (grows) {
    fit.growth = solution[last - 1] / half_mm;
    fit.growth_influence =
        (q.col(last - 1) - r(last - 1, last) * fit.influence) / (r(last - 1, last - 1) * half_mm);
  }
  // The slope of a straight line through what the displacement leaves over.
  const Eigen::VectorXd shared = y - fit.offset_mm * design.col(last);
  fit.stretch = shared.dot(q.col(1)) / r(1, 1) / half_mm;
  return fit;
}

/// The finger that is least like the others, if it is unlike them.
FingerReading* Outlier(const Fit& fit) {
  constexpr double kLimit = 4.5;        // standard deviations: 1 in 100 000 of a normal sample
  constexpr double kFinest_mm = 0.001;  // less is not worth a finger
  std::vector<double> scaled;
  for (Eigen::Index i = 0; i < fit.residual.size(); ++i) {
    scaled.push_back(fit.residual[i] / std::sqrt(std::max(0.05, 1 - fit.leverage[i])));
  }
  const double limit_mm = kLimit * std::max(RobustStandardDeviation(scaled), kFinest_mm / kLimit);
  const auto worst = std::max_element(scaled.begin(), scaled.end(),
                                      [](double a, double b) { return std::abs(a) < std::abs(b); });
  return std::abs(*worst) > limit_mm ? fit.used[static_cast<std::size_t>(worst - scaled.begin())]
                                     : nullptr;
}

std::array<int, 2> CountTeeth(const StructureReading& structure) {
  std::array<int, 2> count{};
  for (const FingerReading& finger : structure.fingers) {
    if (finger.left_out.empty()) ++count[finger.comb];
  }
  return count;
}

/// What most of the teeth that do not count have.
std::string CommonFault(const StructureReading& structure) {
  std::map<std::string, int> faults;
  for (const FingerReading& finger : structure.fingers) {
    if (!finger.left_out.empty()) ++faults[finger.left_out];
  }
  const auto commonest =
      std::max_element(faults.begin(), faults.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return commonest == faults.end() ? "none has a fault" : commonest->first;
}

void Report(const Fit& fit, StructureReading& structure) {
  structure.comb_squares_mm2 = {};
  structure.comb_freedom = {};
  std::array<double, 2> influence{};
  std::array<double, 2> growth{};
  for (Eigen::Index i = 0; i < fit.residual.size(); ++i) {
    FingerReading& finger = *fit.used[static_cast<std::size_t>(i)];
    finger.residual_mm = fit.residual[i];
    structure.comb_squares_mm2[finger.comb] += fit.residual[i] * fit.residual[i];
    structure.comb_freedom[finger.comb] += 1 - fit.leverage[i];
    influence[finger.comb] += fit.influence[i] * fit.influence[i];
    if (structure.lever) {
      growth[finger.comb] += fit.growth_influence[i] * fit.growth_influence[i];
    }
  }
  const double freedom = structure.comb_freedom[0] + structure.comb_freedom[1];
  const double squares = structure.comb_squares_mm2[0] + structure.comb_squares_mm2[1];
  structure.gain = {std::sqrt(influence[0]), std::sqrt(influence[1])};
  structure.growth = fit.growth;
  structure.growth_gain = {std::sqrt(growth[0]), std::sqrt(growth[1])};
  structure.stretch = fit.stretch;
  structure.residual_rms_mm = std::sqrt(squares / freedom);
  Quantity offset;
  offset.value = fit.offset_mm / (1 + fit.stretch);
  offset.standard_uncertainty =
      structure.residual_rms_mm * std::hypot(structure.gain[0], structure.gain[1]);
  const double half = StudentT95(freedom) * offset.standard_uncertainty;
  offset.interval95 = {offset.value - half, offset.value + half};
  structure.offset_mm = Measured::Good(offset);
}

}  // namespace

void FitCombs(const SheetSettings& settings, StructureReading& structure) {
  constexpr double kMostOutliers = 0.3;
  const auto most = static_cast<int>(kMostOutliers * static_cast<double>(structure.fingers.size()));
  for (int outliers = 0;; ++outliers) {
    structure.teeth_used = CountTeeth(structure);
    const auto [first, second] = structure.teeth_used;
    if (first < kFewestTeeth || second < kFewestTeeth) {
      structure.offset_mm = Measured::Refused(
          fmt::format("only {} and {} of {} teeth of the two combs can be read, {} are needed ({})",
                      first, second, settings.teeth, kFewestTeeth, CommonFault(structure)));
      return;
    }
    const Fit fit = FitOnce(settings, structure);
    FingerReading* outlier = outliers < most ? Outlier(fit) : nullptr;
    if (outlier == nullptr) return Report(fit, structure);
    outlier->left_out = "far from where its neighbours say it should be";
  }
}

}  // namespace trammel::tool_offset
