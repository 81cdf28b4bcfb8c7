#include "part_alignment/part_fit/part_fit_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "base/parallel.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/mesh/facet_error.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Eigen::MatrixXd;

// Height of a point over the ideal part, and the direction in which it grows.
struct StockAllowance {
  double mm = 0;
  Vector3d outward;
  std::uint32_t triangle = 0;
  bool at_rim = false;
};

StockAllowance StockAllowanceAt(const IdealSurface& surface, const Vector3d& ideal_mm) {
  if (surface.kind == SurfaceKind::kMesh) {
    const SurfaceDistance distance = surface.mesh->At(ideal_mm);
    const SmoothDistance smooth = SmoothDistanceAt(*surface.mesh, distance, ideal_mm);
    return {smooth.mm, smooth.outward, distance.triangle, distance.at_rim};
  }
  const Vector3d from_middle = ideal_mm - surface.middle_mm;
  if (surface.kind == SurfaceKind::kPlane) {
    return {surface.direction.dot(from_middle), surface.direction};
  }
  const Vector3d radial = from_middle - surface.direction.dot(from_middle) * surface.direction;
  const double radius_mm = radial.norm();
  constexpr double kOnAxis_mm = 1e-9;
  const Vector3d away = radius_mm > kOnAxis_mm ? Vector3d(radial / radius_mm) : Vector3d::Zero();
  if (surface.kind == SurfaceKind::kShaft) return {radius_mm - surface.radius_mm, away};
  return {surface.radius_mm - radius_mm, -away};
}

// Sets each surface's total weight to 1.
void WeighSurfacesAlike(Problem& problem) {
  std::map<const IdealSurface*, int> counts;
  for (const SurfaceContact& contact : problem.contacts) ++counts[contact.surface];
  for (SurfaceContact& contact : problem.contacts) contact.weight = 1.0 / counts[contact.surface];
}

// Computes the share of the normal matrix that the triangles' own tilt may cause.
Matrix6 TiltMatrix(const Problem& problem, const Linear& linear, const Motion& motion) {
  Matrix6 sum = Matrix6::Zero();
  if (!problem.has_mesh) return sum;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const SurfaceContact& contact = problem.contacts[i];
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    const double tilt_rad = FacetErrorOf(*contact.surface->mesh, linear.triangles[i]).tilt_rad;
    const Eigen::Vector3d from_middle = motion(contact.at_mm) - linear.middle_mm;
    Eigen::Matrix<double, 3, 6> displaced;
    displaced.leftCols<3>().setIdentity();
    for (int axis = 0; axis < 3; ++axis) {
      displaced.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(from_middle) / problem.size_mm;
    }
    sum += tilt_rad * tilt_rad * displaced.transpose() * displaced;
  }
  return sum;
}

std::string WordsOf(const Vector6& motion) {
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

VectorXd SolveFor(const MatrixXd& e, const VectorXd& f, const std::vector<Index>& columns) {
  MatrixXd picked(e.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    picked.col(static_cast<Index>(k)) = e.col(columns[k]);
  }
  return geometry::SolveLeastSquares(picked, f);
}

// Solves min |e u - f|, u >= 0: variables enter one by one and are removed where they would become
// negative.
VectorXd NonNegative(const MatrixXd& e, const VectorXd& f) {
  VectorXd u = VectorXd::Zero(e.cols());
  std::vector<Index> passive;
  const Index max_rounds = 3 * e.cols() + 100;
  constexpr double kEnough = 1e-12;
  for (Index round = 0; round < max_rounds; ++round) {
    VectorXd gradient = e.transpose() * (f - e * u);
    for (const Index i : passive) gradient[i] = 0;
    Index enters = 0;
    if (!(gradient.maxCoeff(&enters) > kEnough) || std::ssize(passive) == e.rows()) break;
    passive.push_back(enters);
    while (!passive.empty()) {
      const VectorXd wanted = SolveFor(e, f, passive);
      double step = 1;
      for (std::size_t k = 0; k < passive.size(); ++k) {
        const double from = u[passive[k]];
        const double to = wanted[static_cast<Index>(k)];
        if (to <= 0) step = std::min(step, from / (from - to));
      }
      if (!(step >= 0)) step = 0;
      for (std::size_t k = 0; k < passive.size(); ++k) {
        double& value = u[passive[k]];
        value += step * (wanted[static_cast<Index>(k)] - value);
      }
      if (step >= 1) break;
      std::erase_if(passive, [&u](Index i) {
        constexpr double kGone = 1e-14;
        if (u[i] > kGone) return false;
        u[i] = 0;
        return true;
      });
    }
  }
  return u;
}

}  // namespace

Linear Linearise(const Problem& problem, const Motion& motion) {
  const auto n = std::ssize(problem.contacts);
  Linear linear{VectorXd(n), Eigen::MatrixXd(n, 6)};
  for (const SurfaceContact& contact : problem.contacts) {
    linear.middle_mm += motion(contact.at_mm) / static_cast<double>(n);
  }
  linear.triangles.assign(problem.contacts.size(), 0);
  linear.at_rim.assign(problem.contacts.size(), 0);
  const auto linearise = [&](Index i) {
    const auto at = static_cast<std::size_t>(i);
    const SurfaceContact& contact = problem.contacts[at];
    const Vector3d ideal_mm = motion(contact.at_mm);
    const StockAllowance stock_allowance = StockAllowanceAt(*contact.surface, ideal_mm);
    linear.stock_allowance_mm[i] = stock_allowance.mm - problem.thickness_mm;
    linear.by_motion.row(i) << stock_allowance.outward.transpose(),
        (ideal_mm - linear.middle_mm).cross(stock_allowance.outward).transpose() / problem.size_mm;
    linear.triangles[at] = stock_allowance.triangle;
    linear.at_rim[at] = stock_allowance.at_rim ? 1 : 0;
  };
  constexpr Index kPiece = 500;
  if (!problem.has_mesh || n <= kPiece) {
    for (Index i = 0; i < n; ++i) linearise(i);
    return linear;
  }
  ParallelFor(static_cast<int>((n + kPiece - 1) / kPiece), [&](int piece) {
    for (Index i = piece * kPiece; i < std::min<Index>(n, (piece + 1) * kPiece); ++i) linearise(i);
  });
  return linear;
}

Motion Moved(const Motion& motion, const Linear& linear, const Vector6& step, double size_mm) {
  const Matrix3d rotation = geometry::RotationFromVector(step.tail<3>() / size_mm);
  return {rotation * motion.rotation, rotation * (motion.translation_mm - linear.middle_mm) +
                                          linear.middle_mm + step.head<3>()};
}

VectorXd Wanted(const Problem& problem) {
  VectorXd wanted(std::ssize(problem.contacts));
  for (Index i = 0; i < wanted.size(); ++i) {
    wanted[i] = problem.contacts[static_cast<std::size_t>(i)].surface->stock_allowance_mm;
  }
  return wanted;
}

VectorXd Weights(const Problem& problem) {
  VectorXd weights(std::ssize(problem.contacts));
  for (Index i = 0; i < weights.size(); ++i) {
    weights[i] = problem.contacts[static_cast<std::size_t>(i)].weight;
  }
  return weights;
}

VectorXd Least(const Problem& problem) {
  VectorXd least(std::ssize(problem.contacts));
  for (Index i = 0; i < least.size(); ++i) {
    least[i] = problem.contacts[static_cast<std::size_t>(i)].min_mm;
  }
  return least;
}

double Scatter_mm(const Problem& problem, const Linear& linear) {
  const VectorXd weights = Weights(problem) / Weights(problem).sum();
  const VectorXd surplus = linear.stock_allowance_mm - Wanted(problem);
  return std::sqrt((surplus.array() - surplus.dot(weights)).matrix().cwiseAbs2().dot(weights));
}

double Uneven_mm(const Problem& problem, const Linear& linear) {
  const VectorXd weights = Weights(problem);
  return std::sqrt((linear.stock_allowance_mm - Wanted(problem)).cwiseAbs2().dot(weights) /
                   weights.sum());
}

Problem Thinned(const Problem& problem, std::size_t most) {
  if (problem.contacts.size() <= most) return problem;
  // Multiples of the golden section do not align with any order of rows and columns.
  constexpr double kGolden = 0.6180339887498949;
  std::set<std::size_t> picked;
  for (std::size_t i = 0; i < most; ++i) {
    const double share = kGolden * static_cast<double>(i);
    picked.insert(static_cast<std::size_t>((share - std::floor(share)) *
                                           static_cast<double>(problem.contacts.size())));
  }
  Problem thinned;
  thinned.size_mm = problem.size_mm;
  thinned.has_mesh = problem.has_mesh;
  thinned.thickness_mm = problem.thickness_mm;
  thinned.thickness_sigma_mm = problem.thickness_sigma_mm;
  for (const std::size_t i : picked) thinned.contacts.push_back(problem.contacts[i]);
  WeighSurfacesAlike(thinned);
  return thinned;
}

Problem ProblemOf(const PartFitInput& input, const PartFitOptions& options, double scale) {
  Problem problem;
  problem.thickness_mm = options.target_thickness_mm;
  problem.thickness_sigma_mm = options.target_thickness_sigma_mm;
  std::map<std::string, const IdealSurface*> surfaces;
  for (const IdealSurface& surface : input.surfaces) {
    surfaces[surface.id] = &surface;
    problem.has_mesh = problem.has_mesh || surface.kind == SurfaceKind::kMesh;
  }
  for (std::size_t i = 0; i < input.points.size(); ++i) {
    const MeasuredPoint& point = input.points[i];
    if (point.surface.empty()) continue;
    problem.contacts.push_back(
        {i, surfaces[point.surface], scale * point.at_mm,
         options.min_stock_allowance_mm +
             options.guard_sigmas * std::hypot(point.sigma_mm, problem.thickness_sigma_mm),
         point.sigma_mm, 1});
  }
  Vector3d middle = Vector3d::Zero();
  const auto n = static_cast<double>(problem.contacts.size());
  for (const SurfaceContact& contact : problem.contacts) middle += contact.at_mm / n;
  double square = 0;
  for (const SurfaceContact& contact : problem.contacts)
    square += (contact.at_mm - middle).squaredNorm() / n;
  problem.size_mm = std::max(1.0, std::sqrt(square));
  WeighSurfacesAlike(problem);
  return problem;
}

std::string FreeMotions(const Problem& problem, const Linear& linear, const Motion& motion) {
  if (problem.contacts.empty()) return "everything";
  const Matrix6 normal = linear.by_motion.transpose() * linear.by_motion;
  const Matrix6 tilt = TiltMatrix(problem, linear, motion);
  const geometry::SymmetricEigen of = geometry::DecomposeSymmetric(normal);
  constexpr double kFree = 1e-8;
  std::string words;
  for (int i = 0; i < 6; ++i) {
    const Vector6 vector = of.vectors.col(i);
    const double by_tilt = vector.dot(tilt * vector);
    if (of.values[i] > std::max(kFree * of.values[5], by_tilt)) continue;
    words += (words.empty() ? "" : ", and ") + WordsOf(vector);
  }
  return words;
}

std::optional<LeastDistance> SolveLeastDistance(const MatrixXd& rows, const VectorXd& right) {
  const Index n = rows.cols();
  // Scales rows to one size, right sides to about 1: the test for infeasibility is dimensionless.
  const double size = std::max(right.cwiseAbs().maxCoeff(), 1e-300);
  MatrixXd e(n + 1, rows.rows());
  e.topRows(n) = rows.transpose();
  e.row(n) = right.transpose() / size;
  VectorXd f = VectorXd::Zero(n + 1);
  f[n] = 1;
  const VectorXd u = NonNegative(e, f);
  const VectorXd residual = e * u - f;
  constexpr double kInfeasible = 1e-9;
  if (!(residual.norm() > kInfeasible) || !(std::abs(residual[n]) > kInfeasible * kInfeasible)) {
    return std::nullopt;
  }
  LeastDistance nearest;
  nearest.point = -residual.head(n) / residual[n] * size;
  constexpr double kHolds = 1e-7;
  if (!((rows * nearest.point - right).minCoeff() > -kHolds * size)) return std::nullopt;
  for (Index i = 0; i < u.size(); ++i) {
    if (u[i] > 0) nearest.binding.push_back(i);
  }
  return nearest;
}

Motion FitSurfaces(const Problem& problem, Motion motion, int max_rounds) {
  constexpr double kStill_mm = 1e-9;
  // Fraction of the cost; the steps under the least stock allowance cover the remaining distance.
  const double min_gain = problem.has_mesh ? 1e-6 : 0;
  const Eigen::VectorXd weights = Weights(problem);
  const Eigen::VectorXd wanted = Wanted(problem);
  const auto cost_of = [&](const Linear& linear) {
    return (linear.stock_allowance_mm - wanted).cwiseAbs2().dot(weights);
  };
  Linear linear = Linearise(problem, motion);
  double cost = cost_of(linear);
  double damping = 1e-3;
  for (int round = 0; round < max_rounds && damping < 1e12; ++round) {
    const Eigen::MatrixXd weighted = weights.asDiagonal() * linear.by_motion;
    Eigen::Matrix<double, 6, 6> normal = linear.by_motion.transpose() * weighted;
    normal.diagonal().array() += damping * normal.trace() / 6;
    const Vector6 step = -geometry::SolveSymmetric(
        normal, weighted.transpose() * (linear.stock_allowance_mm - wanted));
    const Motion trial = Moved(motion, linear, step, problem.size_mm);
    Linear there = Linearise(problem, trial);
    const double reached = cost_of(there);
    if (reached <= cost) {
      const bool enough = cost - reached < min_gain * cost;
      motion = trial;
      linear = std::move(there);
      cost = reached;
      damping *= 0.1;
      if (step.norm() < kStill_mm || enough) break;
    } else {
      damping *= 10;
      if (problem.has_mesh && step.norm() < 1e-5) break;
    }
  }
  return motion;
}

}  // namespace trammel::part_alignment
