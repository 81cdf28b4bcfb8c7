#include "part_alignment/pose/solve_input.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <map>
#include <set>

#include "geometry/decompositions.h"
#include "part_alignment/pose/input_effect.h"

namespace trammel::part_alignment {
namespace {

constexpr double kFarthest_mm = 1e6;

bool Within(const Eigen::Vector3d& place_mm) {
  return place_mm.allFinite() && place_mm.cwiseAbs().maxCoeff() <= kFarthest_mm;
}

std::string Text(const Eigen::Vector3d& place_mm) {
  return fmt::format("({}, {}, {})", place_mm.x(), place_mm.y(), place_mm.z());
}

Result<std::map<std::string, std::size_t>> TargetsById(const std::vector<PartTarget>& targets) {
  std::map<std::string, std::size_t> by_id;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (!Within(targets[i].ideal_mm)) {
      return Fail(fmt::format("target {}: ideal_mm is {}, coordinates must lie within +-{} mm",
                              targets[i].id, Text(targets[i].ideal_mm), kFarthest_mm));
    }
    if (!by_id.emplace(targets[i].id, i).second) {
      return Fail(
          fmt::format("target {} is given twice: which of the two is meant?", targets[i].id));
    }
  }
  return by_id;
}

Result<void> CheckView(const View& view, std::size_t number) {
  constexpr double kOrthogonal = 1e-6;
  if (!Within(view.spindle_mm)) {
    return Fail(fmt::format("view {}: spindle_mm is {}, it must lie within +-{} mm", number + 1,
                            Text(view.spindle_mm), kFarthest_mm));
  }
  const Eigen::Matrix3d& rotation = view.spindle_rotation;
  const double off =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kOrthogonal) || !(rotation.determinant() > 0)) {
    return Fail(fmt::format(
        "view {}: spindle_rotation is no rotation (R R^T is off by {:.3g}, determinant {:.3g}): "
        "give its rows as orthogonal unit vectors, right-handed",
        number + 1, off, rotation.determinant()));
  }
  return {};
}

Result<void> CheckObservation(const Camera& camera, const Observation& seen, std::size_t view) {
  const auto inside = [](double place, int size) { return place >= -0.5 && place <= size - 0.5; };
  if (!inside(seen.column_px, camera.width_px) || !inside(seen.row_px, camera.height_px)) {
    return Fail(fmt::format(
        "view {}, target {}: ({}, {}) px lies outside the picture of {} x {} px", view + 1,
        seen.target, seen.column_px, seen.row_px, camera.width_px, camera.height_px));
  }
  if (!(seen.sigma_px >= 1e-6 && seen.sigma_px <= 100)) {
    return Fail(fmt::format("view {}, target {}: sigma_px is {}, it must lie in 1e-6 ... 100",
                            view + 1, seen.target, seen.sigma_px));
  }
  return {};
}

}  // namespace

Result<void> ValidateTargetCovariance(const Eigen::MatrixXd& covariance, std::size_t target_count) {
  constexpr double kRounding = 1e-9;
  constexpr double kMost_mm2 = 1e6;
  const auto rows = 3 * static_cast<Eigen::Index>(target_count);
  if (covariance.rows() != rows || covariance.cols() != rows) {
    return Fail(fmt::format("the targets' covariance is {} x {}, {} targets need {} x {}",
                            covariance.rows(), covariance.cols(), target_count, rows, rows));
  }
  if (!covariance.allFinite() || covariance.cwiseAbs().maxCoeff() > kMost_mm2) {
    return Fail("the targets' covariance has entries that are no numbers or beyond 1e6 mm^2");
  }
  const double largest = covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kRounding * largest) {
    return Fail("the targets' covariance is not symmetric");
  }
  const double least = geometry::SymmetricEigenvalues(covariance).minCoeff();
  if (least < -kRounding * static_cast<double>(rows) * largest) {
    return Fail(
        fmt::format("the targets' covariance is none: along one direction it is {:.3g} "
                    "mm^2, below 0",
                    least));
  }
  return {};
}

Result<PoseProblem> MakeProblem(const Measurement& measurement, const Unknowns& unknowns) {
  TRY(Validate(measurement.camera));
  const auto by_id = TargetsById(measurement.targets);
  if (!by_id) {
    return tl::unexpected(by_id.error());
  }
  PoseProblem problem{measurement.camera, unknowns, {}, {}};
  for (std::size_t number = 0; number < measurement.views.size(); ++number) {
    const View& view = measurement.views[number];
    TRY(CheckView(view, number));
    std::set<std::string> seen_here;
    for (const Observation& seen : view.observations) {
      const auto found = by_id->find(seen.target);
      if (found == by_id->end()) {
        return Fail(fmt::format("view {}: target {} is not among the {} targets of the part",
                                number + 1, seen.target, by_id->size()));
      }
      if (!seen_here.insert(seen.target).second) {
        return Fail(fmt::format("view {}: target {} is observed twice in one picture", number + 1,
                                seen.target));
      }
      TRY(CheckObservation(measurement.camera, seen, number));
      problem.observations.push_back({measurement.targets[found->second].ideal_mm,
                                      view.spindle_rotation.transpose(),
                                      view.spindle_mm,
                                      {seen.column_px, seen.row_px},
                                      seen.sigma_px,
                                      seen.sigma_px,
                                      number,
                                      found->second});
    }
  }
  constexpr std::size_t kMostObservations = 20000;
  if (problem.observations.size() > kMostObservations) {
    return Fail(fmt::format("{} observations, at most {} can be solved for at once",
                            problem.observations.size(), kMostObservations));
  }
  if (problem.observations.empty()) {
    return Fail("no view has an observation: take pictures with targets in them");
  }
  return problem;
}

namespace {

Result<void> ValidateInputs(const SolveOptions& options, double target_mm,
                            std::size_t target_count) {
  TRY(Validate(options.inputs));
  constexpr std::size_t kMostUncertain = 300;  // 900 errors that observations share
  if ((options.target_covariance || target_mm > 0) && target_count > kMostUncertain) {
    return Fail(
        fmt::format("{} targets are uncertain, at most {} can be counted: leave out what "
                    "is not seen{}",
                    target_count, kMostUncertain,
                    options.inputs.target_mm || options.target_covariance
                        ? ""
                        : ", or state target_mm: 0 if they are exact"));
  }
  TRY(options.target_covariance ? ValidateTargetCovariance(*options.target_covariance, target_count)
                                : Result<void>{});
  return options.camera_covariance ? Validate(*options.camera_covariance) : Result<void>{};
}

}  // namespace

InputUncertainty CountedInputs(const Measurement& measurement, const SolveOptions& options) {
  Eigen::AlignedBox3d box;
  for (const PartTarget& target : measurement.targets) box.extend(target.ideal_mm);
  return WithUsualSizes(
      options.inputs,
      {options.camera_covariance.has_value(), options.target_covariance.has_value()},
      box.isEmpty() ? 0 : box.diagonal().norm());
}

Result<PoseProblem> MakeProblem(const Measurement& measurement, const SolveOptions& options) {
  const InputUncertainty inputs = CountedInputs(measurement, options);
  const auto valid = ValidateInputs(options, inputs.target_mm.value(), measurement.targets.size());
  if (!valid) {
    return tl::unexpected(valid.error());
  }
  auto problem = MakeProblem(measurement, options.unknowns);
  if (problem) {
    problem->errors = ErrorsOf(inputs, options.unknowns, measurement.targets.size(),
                               options.target_covariance, options.camera_covariance);
  }
  return problem;
}

}  // namespace trammel::part_alignment
