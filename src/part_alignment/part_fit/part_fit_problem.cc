#include "part_alignment/part_fit/part_fit_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "base/parallel.h"
#include "part_alignment/mesh/facet_error.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// How far a point stands out of the ideal part, and in which direction that grows.
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

// Each surface weighs 1.
void WeighSurfacesAlike(Problem& problem) {
  std::map<const IdealSurface*, int> counts;
  for (const SurfaceContact& contact : problem.contacts) ++counts[contact.surface];
  for (SurfaceContact& contact : problem.contacts) contact.weight = 1.0 / counts[contact.surface];
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
    least[i] = problem.contacts[static_cast<std::size_t>(i)].least_mm;
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
  // Multiples of the golden section fall in step with no order of rows and columns.
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
         options.least_stock_allowance_mm +
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

}  // namespace trammel::part_alignment
