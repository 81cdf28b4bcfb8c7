#include "part_alignment/part_fit/part_fit_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

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
};

StockAllowance StockAllowanceAt(const IdealSurface& surface, const Vector3d& ideal_mm) {
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

}  // namespace

Linear Linearise(const Problem& problem, const Motion& motion) {
  const auto n = std::ssize(problem.contacts);
  Linear linear{VectorXd(n), Eigen::MatrixXd(n, 6)};
  for (const SurfaceContact& contact : problem.contacts) {
    linear.middle_mm += motion(contact.at_mm) / static_cast<double>(n);
  }
  for (Index i = 0; i < n; ++i) {
    const SurfaceContact& contact = problem.contacts[static_cast<std::size_t>(i)];
    const Vector3d ideal_mm = motion(contact.at_mm);
    const StockAllowance stock_allowance = StockAllowanceAt(*contact.surface, ideal_mm);
    linear.stock_allowance_mm[i] = stock_allowance.mm;
    linear.by_motion.row(i) << stock_allowance.outward.transpose(),
        (ideal_mm - linear.middle_mm).cross(stock_allowance.outward).transpose() / problem.size_mm;
  }
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

Problem ProblemOf(const PartFitInput& input, const PartFitOptions& options, double scale) {
  Problem problem;
  std::map<std::string, const IdealSurface*> surfaces;
  std::map<std::string, int> counts;
  for (const IdealSurface& surface : input.surfaces) surfaces[surface.id] = &surface;
  for (std::size_t i = 0; i < input.points.size(); ++i) {
    const MeasuredPoint& point = input.points[i];
    if (point.surface.empty()) continue;
    ++counts[point.surface];
    problem.contacts.push_back(
        {i, surfaces[point.surface], scale * point.at_mm,
         options.least_stock_allowance_mm + options.guard_sigmas * point.sigma_mm, point.sigma_mm,
         1});
  }
  Vector3d middle = Vector3d::Zero();
  const auto n = static_cast<double>(problem.contacts.size());
  for (SurfaceContact& contact : problem.contacts) {
    contact.weight = 1.0 / counts[contact.surface->id];
    middle += contact.at_mm / n;
  }
  double square = 0;
  for (const SurfaceContact& contact : problem.contacts)
    square += (contact.at_mm - middle).squaredNorm() / n;
  problem.size_mm = std::max(1.0, std::sqrt(square));
  return problem;
}

}  // namespace trammel::part_alignment
