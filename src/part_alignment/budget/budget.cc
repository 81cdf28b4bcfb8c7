#include "part_alignment/budget/budget.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
using Eigen::Vector3d;

namespace {

// Returns every corner of the box: each contributor grows outwards, so its largest value is at one
// of them.
std::array<Vector3d, 8> Corners(const BudgetScene& scene) {
  std::array<Vector3d, 8> corners;
  for (unsigned i = 0; i < 8; ++i) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      corners[i][axis] = ((i >> axis) & 1U) != 0 ? scene.high_mm[axis] : scene.low_mm[axis];
    }
  }
  return corners;
}

void SumUp(const BudgetScene& scene, int axis, AxisBudget& budget) {
  budget.combined_mm = std::hypot(budget.u_out_mm, budget.u_ip_mm, budget.u_it_mm);
  budget.expanded_mm = 2 * budget.combined_mm;
  const double share = std::pow(budget.u_ip_mm / budget.combined_mm, 4);
  const bool known = scene.repeats == 0 || !(share > 0);
  budget.degrees_of_freedom =
      known ? std::numeric_limits<double>::infinity() : (scene.repeats - 1) / share;
  // Degrees of freedom above which Student's t is the normal distribution to four digits.
  constexpr double kMany = 1e5;
  budget.coverage_factor = StudentT95(std::min(budget.degrees_of_freedom, kMany));
  TRAMMEL_CHECK(std::isfinite(budget.combined_mm), "axis {}: {}", axis, budget.combined_mm);
}

// Computes the size that 95 % of the sizes do not exceed.
double HalfInterval(std::vector<double>& errors) {
  for (double& error : errors) error = std::abs(error);
  constexpr double kProbability = 0.95;
  const auto rank = static_cast<std::ptrdiff_t>(kProbability * static_cast<double>(errors.size()));
  const auto at = errors.begin() + std::min<std::ptrdiff_t>(rank, std::ssize(errors) - 1);
  std::nth_element(errors.begin(), at, errors.end());
  return *at;
}

void Simulate(const BudgetScene& scene, const BudgetTerms& terms, int trials, Random& random,
              Budget& budget) {
  std::array<std::vector<double>, 3> errors;
  for (auto& list : errors) list.reserve(static_cast<std::size_t>(trials));
  for (int trial = 0; trial < trials; ++trial) {
    const Eigen::Matrix<double, 6, 1> motion = DrawMotion(scene, terms, random);
    const double strain = DrawStrain(scene, random);
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const Vector3d& at_mm = budget.axes[i].at_mm;
      const double moved_mm = (MotionAt(at_mm) * motion)[axis];
      const double grown_mm = strain * (at_mm - scene.still_mm)[axis];
      errors[i].push_back(moved_mm + grown_mm + DrawOut(scene, axis, random));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    budget.axes[i].simulated_mm = StandardDeviation(errors[i]);
    budget.axes[i].simulated_expanded_mm = HalfInterval(errors[i]);
  }
  budget.trials = trials;
}

}  // namespace

Result<Budget> MakeBudget(const BudgetScene& scene, int trials, Random& random) {
  constexpr int kMaxTrials = 10'000'000;
  if (trials < 0 || trials > kMaxTrials) {
    return Fail(fmt::format("{} trials; they must be 0 … {}", trials, kMaxTrials));
  }
  const auto terms = TRY(TermsOf(scene));
  Budget budget;
  for (int axis = 0; axis < 3; ++axis) {
    AxisBudget& worst = budget.axes[static_cast<std::size_t>(axis)];
    for (const Vector3d& corner : Corners(scene)) {
      AxisBudget here;
      here.at_mm = corner;
      const Eigen::Matrix<double, 3, 6> by_motion = MotionAt(corner);
      here.u_ip_mm =
          std::sqrt(geometry::PropagateCovariance(by_motion, terms.motion_covariance)(axis, axis));
      here.u_it_mm = ExpansionSigma(scene, corner)[axis];
      here.u_out_mm = OutSigma(scene)[axis];
      SumUp(scene, axis, here);
      if (here.combined_mm > worst.combined_mm) worst = here;
    }
  }
  if (trials > 0) Simulate(scene, terms, trials, random, budget);
  return budget;
}

Result<LengthErrors> JudgeLengths(std::span<const MeasuredLength> lengths, double constant_mm,
                                  double per_mm) {
  if (lengths.empty()) return Fail("no lengths to judge");
  if (!(constant_mm >= 0 && per_mm >= 0)) {
    return Fail(
        fmt::format("a limit of {} mm + {} per mm; neither may be below 0", constant_mm, per_mm));
  }
  LengthErrors errors;
  errors.within = true;
  double longest_mm = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const MeasuredLength& length = lengths[i];
    if (!(length.calibrated_mm > 0) || !std::isfinite(length.calibrated_mm) ||
        !std::isfinite(length.measured_mm)) {
      return Fail(
          fmt::format("length {}: {} mm measured as {} mm; both must be finite, the first "
                      "above 0",
                      i, length.calibrated_mm, length.measured_mm));
    }
    const double error_mm = std::abs(length.measured_mm - length.calibrated_mm);
    if (error_mm > errors.largest_mm) {
      errors.largest_mm = error_mm;
      errors.worst = i;
    }
    // Written limits may equal written lengths: binary rounding must not decide.
    constexpr double kRounding_mm = 1e-9;
    errors.within =
        errors.within && error_mm <= constant_mm + per_mm * length.calibrated_mm + kRounding_mm;
    longest_mm = std::max(longest_mm, length.calibrated_mm);
  }
  constexpr std::size_t kFullTest = 35;  // seven lines of five lengths
  if (lengths.size() < kFullTest) {
    errors.notices.push_back(
        fmt::format("{} lengths up to {:.0f} mm: VDI/VDE 2634 part 1 asks for five along each of "
                    "seven lines over the whole volume",
                    lengths.size(), longest_mm));
  }
  return errors;
}

Capability JudgeCapability(double expanded_mm, double lower_mm, double upper_mm, double max_ratio) {
  TRAMMEL_CHECK(upper_mm > lower_mm && max_ratio > 0, "{} … {} mm, ratio {}", lower_mm, upper_mm,
                max_ratio);
  const double ratio = expanded_mm / (upper_mm - lower_mm);
  return {ratio, 2 * ratio, ratio <= max_ratio};
}

namespace {

Result<void> Check(const BudgetScene& scene) {
  constexpr double kMax_mm = 1e6;
  const auto sound = [](const auto& v) {
    return v.allFinite() && v.cwiseAbs().maxCoeff() < kMax_mm;
  };
  bool finite = sound(scene.target_sigma_mm) && sound(scene.pose_sigma) && sound(scene.low_mm) &&
                sound(scene.high_mm) && sound(scene.still_mm) &&
                (!scene.out_sigma_mm || sound(*scene.out_sigma_mm));
  for (const Vector3d& target : scene.targets_mm) finite = finite && sound(target);
  if (!finite) {
    return Fail(fmt::format("a number of the budget is not finite, or beyond {:g} mm", kMax_mm));
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
  // Rotations in rad and mm: scaled to one size before the rank is checked.
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
