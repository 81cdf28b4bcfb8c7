#include "part_alignment/budget/budget_terms.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

Result<void> Check(const BudgetScene& scene) {
  constexpr double kMost_mm = 1e6;
  const auto sound = [](const auto& v) {
    return v.allFinite() && v.cwiseAbs().maxCoeff() < kMost_mm;
  };
  bool finite = sound(scene.target_sigma_mm) && sound(scene.pose_sigma) && sound(scene.low_mm) &&
                sound(scene.high_mm) && sound(scene.still_mm) &&
                (!scene.out_sigma_mm || sound(*scene.out_sigma_mm));
  for (const Vector3d& target : scene.targets_mm) finite = finite && sound(target);
  if (!finite) {
    return Fail(fmt::format("a number of the budget is not finite, or beyond {:g} mm", kMost_mm));
  }
  if (!((scene.high_mm - scene.low_mm).minCoeff() >= 0)) {
    return Fail(fmt::format("the box ends at {} {} {} mm, before it begins at {} {} {} mm",
                            scene.high_mm.x(), scene.high_mm.y(), scene.high_mm.z(),
                            scene.low_mm.x(), scene.low_mm.y(), scene.low_mm.z()));
  }
  if (!(scene.target_sigma_mm.minCoeff() > 0)) {
    return Fail(fmt::format("the targets' uncertainty is {} {} {} mm; each must be above 0",
                            scene.target_sigma_mm.x(), scene.target_sigma_mm.y(),
                            scene.target_sigma_mm.z()));
  }
  const bool negative =
      scene.pose_sigma.minCoeff() < 0 || !(scene.temperature_half_width_k >= 0) ||
      !std::isfinite(scene.temperature_half_width_k) || !(scene.length_error_mm >= 0) ||
      !(scene.length_error_per_mm >= 0) || !std::isfinite(scene.length_error_mm) ||
      !std::isfinite(scene.length_error_per_mm) || !std::isfinite(scene.expansion_per_k) ||
      (scene.out_sigma_mm && scene.out_sigma_mm->minCoeff() < 0);
  if (negative) return Fail("an uncertainty of the budget is below 0 or not finite");
  if (scene.repeats < 0 || scene.repeats == 1) {
    return Fail(fmt::format("{} repeats; they must be 0 (known) or at least 2", scene.repeats));
  }
  return {};
}

}  // namespace

Eigen::Matrix<double, 3, 6> MotionAt(const Vector3d& point_mm) {
  Eigen::Matrix<double, 3, 6> by_motion;
  by_motion.leftCols<3>().setIdentity();
  for (int i = 0; i < 3; ++i) by_motion.col(3 + i) = Vector3d::Unit(i).cross(point_mm);
  return by_motion;
}

Result<BudgetTerms> TermsOf(const BudgetScene& scene) {
  TRY(Check(scene));
  const auto n = static_cast<Eigen::Index>(scene.targets_mm.size());
  if (n < 3) return Fail(fmt::format("{} targets; a part needs three, not in one line", n));
  const Vector3d weight = scene.target_sigma_mm.cwiseAbs2().cwiseInverse();
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::MatrixXd right(6, 3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Matrix<double, 3, 6> by = MotionAt(scene.targets_mm[static_cast<std::size_t>(i)]);
    normal += by.transpose() * weight.asDiagonal() * by;
    right.middleCols<3>(3 * i) = by.transpose() * weight.asDiagonal();
  }
  // Turns in rad and mm: to one size before judging the rank.
  const Eigen::Matrix<double, 6, 1> scale = normal.diagonal().cwiseSqrt();
  constexpr const char* kInLine =
      "the targets lie in one line (or nearly): the part's turn about it is not determined";
  if (!(scale.minCoeff() > 0)) return Fail(kInLine);
  const Eigen::Matrix<double, 6, 1> unscale = scale.cwiseInverse();
  const Eigen::Matrix<double, 6, 6> scaled = unscale.asDiagonal() * normal * unscale.asDiagonal();
  constexpr double kRank = 1e-10;
  if (!(geometry::SymmetricEigenvalues(scaled)[0] > kRank)) return Fail(kInLine);
  const Eigen::Matrix<double, 6, 6> inverse =
      unscale.asDiagonal() * geometry::Inverse(scaled) * unscale.asDiagonal();
  BudgetTerms terms;
  terms.motion_from_targets = inverse * right;
  terms.motion_covariance = inverse;
  terms.motion_covariance.diagonal() += scene.pose_sigma.cwiseAbs2();
  return terms;
}

Vector3d ExpansionSigma(const BudgetScene& scene, const Vector3d& point_mm) {
  const double strain =
      std::abs(scene.expansion_per_k) * scene.temperature_half_width_k / std::numbers::sqrt3;
  return (point_mm - scene.still_mm).cwiseAbs() * strain;
}

Vector3d OutSigma(const BudgetScene& scene) {
  if (scene.out_sigma_mm) return *scene.out_sigma_mm;
  const Vector3d length_mm = scene.high_mm - scene.low_mm;
  return (scene.length_error_per_mm * length_mm.array() + scene.length_error_mm) /
         std::numbers::sqrt3;
}

Eigen::Matrix<double, 6, 1> DrawMotion(const BudgetScene& scene, const BudgetTerms& terms,
                                       Random& random) {
  Eigen::VectorXd errors(terms.motion_from_targets.cols());
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    errors[i] = random.Normal(0, scene.target_sigma_mm[i % 3]);
  }
  Eigen::Matrix<double, 6, 1> motion = terms.motion_from_targets * errors;
  for (int i = 0; i < 6; ++i) motion[i] += random.Normal(0, scene.pose_sigma[i]);
  return motion;
}

double DrawStrain(const BudgetScene& scene, Random& random) {
  return scene.expansion_per_k *
         random.Uniform(-scene.temperature_half_width_k, scene.temperature_half_width_k);
}

double DrawOut(const BudgetScene& scene, int axis, Random& random) {
  const double sigma_mm = OutSigma(scene)[axis];
  if (scene.out_sigma_mm) return random.Normal(0, sigma_mm);
  return random.Uniform(-1, 1) * sigma_mm * std::numbers::sqrt3;
}

}  // namespace trammel::part_alignment
