#include "part_alignment/part_fit/part_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/part_fit/least_distance.h"
#include "part_alignment/part_fit/part_fit_input.h"
#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// The step towards even stock allowance that leaves `least` everywhere; absent where none does.
struct Step {
  Vector6 motion = Vector6::Zero();
  std::vector<Index> binding;
};

std::optional<Step> EvenStep(const Problem& problem, const Linear& linear, const VectorXd& least) {
  const VectorXd weights = Weights(problem);
  const MatrixXd weighted = weights.asDiagonal() * linear.by_motion;
  const Matrix6 normal = linear.by_motion.transpose() * weighted;
  const MatrixXd root = geometry::CholeskyRoot(normal);
  const Vector6 gradient = weighted.transpose() * (linear.stock_allowance_mm - Wanted(problem));
  const Vector6 q = geometry::SolveLower(root, gradient);
  // With z = Lᵀ y + q the sum of squares is |z|² and a constant.
  const MatrixXd rows = geometry::SolveLower(root, linear.by_motion.transpose()).transpose();
  const VectorXd right = least - linear.stock_allowance_mm + rows * q;
  const auto nearest = SolveLeastDistance(rows, right);
  if (!nearest) return std::nullopt;
  const Vector6 z = nearest->point;
  return Step{geometry::SolveUpper(root.transpose(), z - q), nearest->binding};
}

constexpr int kMostRounds = 60;
constexpr double kStill_mm = 1e-9;

// Least squares alone, damped: from a rough start to where the surfaces are.
Motion FitSurfaces(const Problem& problem, Motion motion) {
  const VectorXd weights = Weights(problem);
  const VectorXd wanted = Wanted(problem);
  const auto cost = [&](const Linear& linear) {
    return (linear.stock_allowance_mm - wanted).cwiseAbs2().dot(weights);
  };
  Linear linear = Linearise(problem, motion);
  double damping = 1e-3;
  for (int round = 0; round < 4 * kMostRounds && damping < 1e12; ++round) {
    const MatrixXd weighted = weights.asDiagonal() * linear.by_motion;
    Matrix6 normal = linear.by_motion.transpose() * weighted;
    normal.diagonal().array() += damping * normal.trace() / 6;
    const Vector6 step = -geometry::SolveSymmetric(
        normal, weighted.transpose() * (linear.stock_allowance_mm - wanted));
    const Motion trial = Moved(motion, linear, step, problem.size_mm);
    const Linear there = Linearise(problem, trial);
    if (cost(there) <= cost(linear)) {
      motion = trial;
      linear = there;
      damping *= 0.1;
      if (step.norm() < kStill_mm) break;
    } else {
      damping *= 10;
    }
  }
  return motion;
}

// The placement whose worst point has the most stock allowance, by bisection on how much that is.
Motion BestEffort(const Problem& problem, Motion motion, double& missing_mm) {
  for (int round = 0; round < 10; ++round) {
    const Linear linear = Linearise(problem, motion);
    const VectorXd least = Least(problem);
    double unreachable = 0;
    double reachable = (linear.stock_allowance_mm - least).minCoeff() - 1e-6;
    std::optional<Step> step;
    for (int cut = 0; cut < 40; ++cut) {
      const double shift = (unreachable + reachable) / 2;
      const auto found = EvenStep(problem, linear, least.array() + shift);
      (found ? reachable : unreachable) = shift;
      if (found) step = found;
    }
    missing_mm = -reachable;
    if (!step) break;
    motion = Moved(motion, linear, step->motion, problem.size_mm);
    if (step->motion.norm() < 1e-6) break;
  }
  return motion;
}

// Kabsch's rotation between the middles of the surfaces and of their points.
std::optional<Motion> StartFromMiddles(const Problem& problem) {
  std::map<const IdealSurface*, std::pair<Vector3d, int>> sums;
  for (const SurfaceContact& contact : problem.contacts) {
    auto& [sum, count] = sums.try_emplace(contact.surface, Vector3d::Zero(), 0).first->second;
    sum += contact.at_mm;
    ++count;
  }
  if (sums.size() < 3) return std::nullopt;
  const auto count = static_cast<double>(sums.size());
  Vector3d ideal_mean = Vector3d::Zero();
  Vector3d measured_mean = Vector3d::Zero();
  for (const auto& [surface, sum] : sums) {
    ideal_mean += surface->middle_mm / count;
    measured_mean += sum.first / sum.second / count;
  }
  Matrix3d cross = Matrix3d::Zero();
  for (const auto& [surface, sum] : sums) {
    cross +=
        (surface->middle_mm - ideal_mean) * (sum.first / sum.second - measured_mean).transpose();
  }
  const geometry::SingularValues of = geometry::DecomposeSingular(cross);
  const Matrix3d u = of.u;
  const Matrix3d v = of.v;
  constexpr double kLine = 1e-3;
  if (!(of.values[1] > kLine * of.values[0])) return std::nullopt;
  Matrix3d flip = Matrix3d::Identity();
  if (u.determinant() * v.determinant() < 0) flip(2, 2) = -1;
  Motion motion;
  motion.rotation = u * flip * v.transpose();
  motion.translation_mm = ideal_mean - motion.rotation * measured_mean;
  return motion;
}

// A motion that changes no stock allowance, in words; empty where there is none.
std::string FreeMotion(const Problem& problem, const Linear& linear) {
  if (problem.contacts.empty()) return "everything";
  const Matrix6 normal = linear.by_motion.transpose() * linear.by_motion;
  const geometry::SymmetricEigen of = geometry::DecomposeSymmetric(normal);
  constexpr double kFree = 1e-8;
  if (of.values[0] > kFree * of.values[5]) return {};
  const Vector6 motion = of.vectors.col(0);
  constexpr const char* kNames[] = {"a shift along x", "a shift along y", "a shift along z",
                                    "a turn about x",  "a turn about y",  "a turn about z"};
  std::string words;
  constexpr double kShare = 0.3;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(motion[i]) > kShare)
      words += (words.empty() ? "" : " with ") + std::string(kNames[i]);
  }
  return words;
}

void NoteStockAllowances(const PartFitInput& input, const Problem& problem, const Motion& motion,
                         const std::vector<Index>& binding, PartFit& fit) {
  const Linear linear = Linearise(problem, motion);
  fit.ideal_from_measured = {motion.translation_mm, geometry::AnglesFromRotation(motion.rotation)};
  fit.stock_allowances.clear();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const SurfaceContact& contact = problem.contacts[i];
    fit.stock_allowances.push_back({contact.point, linear.stock_allowance_mm[static_cast<Index>(i)],
                                    contact.surface->stock_allowance_mm, contact.least_mm, false});
  }
  for (const Index i : binding) fit.stock_allowances[static_cast<std::size_t>(i)].binding = true;
  fit.least_mm = linear.stock_allowance_mm.minCoeff();
  fit.mean_mm = linear.stock_allowance_mm.mean();
  const VectorXd weights = Weights(problem);
  fit.uneven_mm = std::sqrt((linear.stock_allowance_mm - Wanted(problem)).cwiseAbs2().dot(weights) /
                            weights.sum());
  for (const MeasuredPoint& point : input.points) {
    if (!point.surface.empty()) continue;
    fit.targets.push_back({point.id, motion(fit.scale * point.at_mm)});
  }
}

// How the placement follows errors of the points along their normals: the conditions of its optimum
// with the same points binding (Karush, Kuhn and Tucker), differentiated.
Matrix6 PlacementCovariance(const Problem& problem, const Linear& linear,
                            const std::vector<Index>& binding) {
  const auto n = std::ssize(problem.contacts);
  const auto active = std::ssize(binding);
  const MatrixXd weighted = Weights(problem).asDiagonal() * linear.by_motion;
  MatrixXd system = MatrixXd::Zero(6 + active, 6 + active);
  MatrixXd right = MatrixXd::Zero(6 + active, n);
  system.topLeftCorner<6, 6>() = linear.by_motion.transpose() * weighted;
  right.topRows<6>() = -weighted.transpose();
  for (Index k = 0; k < active; ++k) {
    const Index i = binding[static_cast<std::size_t>(k)];
    system.block<1, 6>(6 + k, 0) = linear.by_motion.row(i);
    system.block<6, 1>(0, 6 + k) = linear.by_motion.row(i).transpose();
    right(6 + k, i) = -1;
  }
  const MatrixXd by_error = geometry::SolveLeastSquares(system, right).topRows(6);
  VectorXd variance(n);
  for (Index i = 0; i < n; ++i) {
    const double sigma_mm = problem.contacts[static_cast<std::size_t>(i)].sigma_mm;
    variance[i] = sigma_mm * sigma_mm;
  }
  return by_error * variance.asDiagonal() * by_error.transpose();
}

void NoteCovariance(const PartFitInput& input, const Problem& problem, const Motion& motion,
                    const std::vector<Index>& binding, PartFit& fit) {
  const Linear linear = Linearise(problem, motion);
  const Matrix6 placement = PlacementCovariance(problem, linear, binding);
  const auto n = 3 * std::ssize(fit.targets);
  MatrixXd by_placement(n, 6);
  VectorXd by_scale(n);
  VectorXd own(n);
  Index row = 0;
  for (const MeasuredPoint& point : input.points) {
    if (!point.surface.empty()) continue;
    const Vector3d from_middle = motion(fit.scale * point.at_mm) - linear.middle_mm;
    by_placement.block<3, 3>(row, 0).setIdentity();
    for (int i = 0; i < 3; ++i) {
      by_placement.block<3, 1>(row, 3 + i) = Vector3d::Unit(i).cross(from_middle) / problem.size_mm;
    }
    // The placement keeps the middle where it is when everything grows about it.
    by_scale.segment<3>(row) = from_middle * fit.scale_sigma;
    own.segment<3>(row).setConstant(point.sigma_mm * point.sigma_mm);
    row += 3;
  }
  fit.covariance = by_placement * placement * by_placement.transpose() +
                   by_scale * by_scale.transpose() + MatrixXd(own.asDiagonal());
}

PartFit Refuse(const PartFitInput& input, const Problem& problem, const Motion& start,
               PartFit fit) {
  double missing_mm = 0;
  const Motion best = BestEffort(problem, start, missing_mm);
  NoteStockAllowances(input, problem, best, {}, fit);
  fit.targets.clear();
  std::string where;
  constexpr double kNearlyWorst_mm = 1e-3;
  for (const PointStockAllowance& at : fit.stock_allowances) {
    if (at.stock_allowance_mm - at.least_mm > -missing_mm + kNearlyWorst_mm) continue;
    const MeasuredPoint& point = input.points[at.point];
    where += fmt::format("{}{} ({}, {:+.3f} mm)", where.empty() ? "" : ", ", point.id,
                         point.surface, at.stock_allowance_mm);
  }
  fit.verdict = Verdict::kRefused;
  fit.reason = fmt::format(
      "no placement leaves enough material everywhere: at best {:.3f} mm are missing, at {}",
      missing_mm, where.empty() ? "several points" : where);
  return fit;
}

}  // namespace

Result<PartFit> FitPart(const PartFitInput& given, const PartFitOptions& options) {
  const auto checked = CheckedPartFit(given, options);
  if (!checked) return tl::unexpected(checked.error());
  const PartFitInput& input = *checked;
  PartFit fit;
  const BarScale bars = ScaleOf(input, options);
  fit.scale = bars.scale;
  fit.scale_sigma = bars.sigma;
  if (!bars.notice.empty()) fit.notices.push_back(bars.notice);
  if (!bars.fault.empty()) {
    fit.reason = bars.fault;
    return fit;
  }
  const Problem problem = ProblemOf(input, options, fit.scale);
  std::optional<Motion> motion;
  if (input.start) {
    motion =
        Motion{geometry::RotationFromAngles(input.start->angles_rad), input.start->translation_mm};
  } else {
    motion = StartFromMiddles(problem);
  }
  if (!motion) {
    fit.verdict = Verdict::kCannotTell;
    fit.reason =
        "fewer than three surfaces, or their middles in one line: where the ideal part lies "
        "roughly "
        "must be given (start)";
    return fit;
  }
  *motion = FitSurfaces(problem, *motion);
  const std::string free = FreeMotion(problem, Linearise(problem, *motion));
  if (!free.empty()) {
    fit.verdict = Verdict::kCannotTell;
    fit.reason = fmt::format(
        "the measured surfaces leave the part free: {} changes no stock allowance; measure a "
        "surface that stops it",
        free);
    return fit;
  }
  std::vector<Index> binding;
  for (int round = 0; round < kMostRounds; ++round) {
    const Linear linear = Linearise(problem, *motion);
    const auto step = EvenStep(problem, linear, Least(problem));
    if (!step) return Refuse(input, problem, *motion, std::move(fit));
    *motion = Moved(*motion, linear, step->motion, problem.size_mm);
    binding = step->binding;
    if (step->motion.norm() < kStill_mm) break;
  }
  fit.verdict = Verdict::kGood;
  NoteStockAllowances(input, problem, *motion, binding, fit);
  NoteCovariance(input, problem, *motion, binding, fit);
  return fit;
}

}  // namespace trammel::part_alignment
