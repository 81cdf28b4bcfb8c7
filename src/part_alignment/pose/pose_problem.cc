#include "part_alignment/pose/pose_problem.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "geometry/decompositions.h"
#include "part_alignment/pose/joint_fit.h"

namespace trammel::part_alignment {
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::RotationDerivative;
using geometry::RotationFromAngles;

namespace {

struct UnknownGroup {
  bool Unknowns::*asked;
  int Layout::*first;
  int count;
  std::array<const char*, 3> parameters;
  std::array<const char*, 3> words;
};
// Unknowns that may join the pose, in the order of theta.
constexpr std::array kGroups{
    UnknownGroup{
        &Unknowns::clamp_angle, &Layout::clamp_angle, 1, {"clamp_angle_rad"}, {"the clamp angle"}},
    UnknownGroup{&Unknowns::clamp_eccentricity,
                 &Layout::clamp_eccentricity,
                 2,
                 {"clamp_eccentricity_x_mm", "clamp_eccentricity_y_mm"},
                 {"the clamp eccentricity in X", "the clamp eccentricity in Y"}},
    UnknownGroup{&Unknowns::clamp_tilt,
                 &Layout::clamp_tilt,
                 2,
                 {"clamp_tilt_x_rad", "clamp_tilt_y_rad"},
                 {"the clamp tilt about X", "the clamp tilt about Y"}},
    UnknownGroup{&Unknowns::focal_length,
                 &Layout::focal_length,
                 1,
                 {"focal_length_mm"},
                 {"the focal length"}},
    UnknownGroup{
        &Unknowns::camera_offset,
        &Layout::camera_offset,
        3,
        {"camera_offset_x_mm", "camera_offset_y_mm", "camera_offset_z_mm"},
        {"the camera's offset in X", "the camera's offset in Y", "the camera's offset in Z"}}};

std::vector<std::string> Names(const Unknowns& unknowns, std::vector<std::string> of_pose,
                               std::array<const char*, 3> UnknownGroup::*of_group) {
  for (const UnknownGroup& group : kGroups) {
    if (!(unknowns.*group.asked)) continue;
    const auto& names = group.*of_group;
    of_pose.insert(of_pose.end(), names.begin(), names.begin() + group.count);
  }
  return of_pose;
}

}  // namespace

Layout LayoutOf(const Unknowns& unknowns) {
  Layout layout;
  for (const UnknownGroup& group : kGroups) {
    if (!(unknowns.*group.asked)) continue;
    layout.*group.first = layout.size;
    layout.size += group.count;
  }
  return layout;
}

std::vector<std::string> ParameterNames(const Unknowns& unknowns) {
  return Names(unknowns, {"x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad"},
               &UnknownGroup::parameters);
}

std::vector<std::string> UnknownNames(const Unknowns& unknowns) {
  return Names(unknowns,
               {"the part's X", "the part's Y", "the part's Z", "the part's rotation about X",
                "the part's rotation about Y", "the part's rotation about Z"},
               &UnknownGroup::words);
}

Camera CameraOf(const PoseProblem& problem, const Theta& theta) {
  const Layout layout = LayoutOf(problem.unknowns);
  Camera camera = problem.camera;
  if (layout.focal_length >= 0) camera.focal_length_mm = theta[layout.focal_length];
  if (layout.camera_offset >= 0) {
    camera.taper_from_camera.translation_mm = theta.segment<3>(layout.camera_offset);
  }
  return camera;
}

geometry::Pose PoseOf(const Theta& theta) { return {theta.head<3>(), theta.segment<3>(3)}; }

Clamping ClampingOf(const Layout& layout, const Theta& theta) {
  Clamping clamping;
  if (layout.clamp_angle >= 0) {
    clamping.angle_rad = theta[layout.clamp_angle];
  }
  if (layout.clamp_eccentricity >= 0) {
    clamping.eccentricity_mm = theta.segment<2>(layout.clamp_eccentricity);
  }
  if (layout.clamp_tilt >= 0) {
    clamping.tilt_rad = theta.segment<2>(layout.clamp_tilt);
  }
  return clamping;
}

Theta ThetaOf(const PoseProblem& problem, const geometry::Pose& machine_from_part,
              const Clamping& clamping) {
  const Layout layout = LayoutOf(problem.unknowns);
  Theta theta(layout.size);
  theta.head<3>() = machine_from_part.translation_mm;
  theta.segment<3>(3) = machine_from_part.angles_rad;
  if (layout.clamp_angle >= 0) {
    theta[layout.clamp_angle] = clamping.angle_rad;
  }
  if (layout.clamp_eccentricity >= 0) {
    theta.segment<2>(layout.clamp_eccentricity) = clamping.eccentricity_mm;
  }
  if (layout.clamp_tilt >= 0) {
    theta.segment<2>(layout.clamp_tilt) = clamping.tilt_rad;
  }
  if (layout.focal_length >= 0) {
    theta[layout.focal_length] = problem.camera.focal_length_mm;
  }
  if (layout.camera_offset >= 0) {
    theta.segment<3>(layout.camera_offset) = problem.camera.taper_from_camera.translation_mm;
  }
  return theta;
}

Chain::Chain(const PoseProblem& problem, const Theta& theta, bool with_derivatives)
    : layout_(LayoutOf(problem.unknowns)), camera_(CameraOf(problem, theta)) {
  const Clamping clamping = ClampingOf(layout_, theta);
  const Vector3d part_rad = theta.segment<3>(3);
  const Vector3d about_z(0, 0, -clamping.angle_rad);
  const Vector3d about_x(clamping.tilt_rad.x(), 0, 0);
  const Vector3d about_y(0, clamping.tilt_rad.y(), 0);
  const Matrix3d turn = RotationFromAngles(about_z);
  const Matrix3d tilt_x = RotationFromAngles(about_x);
  const Matrix3d tilt_y = RotationFromAngles(about_y);
  translation_mm_ = theta.head<3>();
  eccentricity_mm_ = clamping.eccentricity_mm;
  machine_from_part_ = RotationFromAngles(part_rad);
  camera_from_taper_ = RotationFromAngles(camera_.taper_from_camera.angles_rad).transpose();
  camera_from_spindle_ = camera_from_taper_ * (turn * tilt_x * tilt_y).transpose();
  if (!with_derivatives) {
    return;
  }
  for (int i = 0; i < 3; ++i) {
    by_part_angle_[i] = RotationDerivative(part_rad, i);
  }
  // The angle enters as Rz(-angle): equation 27 with its element (3, 3) corrected to 0.
  by_clamp_angle_ =
      camera_from_taper_ * (-RotationDerivative(about_z, 2) * tilt_x * tilt_y).transpose();
  by_tilt_[0] = camera_from_taper_ * (turn * RotationDerivative(about_x, 0) * tilt_y).transpose();
  by_tilt_[1] = camera_from_taper_ * (turn * tilt_x * RotationDerivative(about_y, 1)).transpose();
}

Vector3d Chain::SpindlePoint(const WeightedObservation& observation) const {
  Vector3d spindle_mm =
      observation.spindle_from_machine *
      (machine_from_part_ * observation.part_mm + translation_mm_ - observation.spindle_mm);
  spindle_mm.head<2>() -= eccentricity_mm_;
  return spindle_mm;
}

bool Chain::Residual(const WeightedObservation& observation, Vector2d& residual_px) const {
  const Vector3d offset_mm = camera_.taper_from_camera.translation_mm;
  const auto pixel = Project(
      camera_, camera_from_spindle_ * SpindlePoint(observation) - camera_from_taper_ * offset_mm);
  if (!pixel) {
    return false;
  }
  residual_px = observation.pixel - *pixel;
  return true;
}

bool Chain::ResidualAndDerivative(const WeightedObservation& observation, Vector2d& residual_px,
                                  ObservationDerivative& derivative) const {
  const Vector3d spindle_mm = SpindlePoint(observation);
  const Vector3d offset_mm = camera_.taper_from_camera.translation_mm;
  const auto projection = ProjectWithDerivative(
      camera_, camera_from_spindle_ * spindle_mm - camera_from_taper_ * offset_mm);
  if (!projection) {
    return false;
  }
  residual_px = observation.pixel - projection->pixel;
  derivative.resize(2, layout_.size);
  const Eigen::Matrix<double, 2, 3> by_spindle = projection->by_point * camera_from_spindle_;
  const Eigen::Matrix<double, 2, 3> by_machine = by_spindle * observation.spindle_from_machine;
  derivative.leftCols<3>() = by_machine;
  for (int i = 0; i < 3; ++i) {
    derivative.col(3 + i) = by_machine * (by_part_angle_[i] * observation.part_mm);
  }
  if (layout_.clamp_angle >= 0) {
    derivative.col(layout_.clamp_angle) = projection->by_point * (by_clamp_angle_ * spindle_mm);
  }
  if (layout_.clamp_eccentricity >= 0) {
    derivative.middleCols<2>(layout_.clamp_eccentricity) = -by_spindle.leftCols<2>();
  }
  if (layout_.clamp_tilt >= 0) {
    for (int i = 0; i < 2; ++i) {
      derivative.col(layout_.clamp_tilt + i) = projection->by_point * (by_tilt_[i] * spindle_mm);
    }
  }
  if (layout_.focal_length >= 0) {
    derivative.col(layout_.focal_length) = projection->by_focal_length;
  }
  if (layout_.camera_offset >= 0) {
    derivative.middleCols<3>(layout_.camera_offset) = -projection->by_point * camera_from_taper_;
  }
  return true;
}

Eigen::MatrixXd WeightedJacobian(const PoseProblem& problem, const Theta& theta) {
  const Chain chain(problem, theta, true);
  Eigen::MatrixXd jacobian(2 * problem.observations.size(), theta.size());
  Vector2d residual_px;
  ObservationDerivative derivative;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (!chain.ResidualAndDerivative(problem.observations[i], residual_px, derivative)) {
      return {};
    }
    jacobian.middleRows<2>(2 * static_cast<Eigen::Index>(i)) =
        derivative / problem.observations[i].sigma_px;
  }
  return jacobian;
}

double ChiSquare(const PoseProblem& problem, const Theta& theta) {
  const Chain chain(problem, theta, false);
  double sum = 0;
  Vector2d residual_px;
  for (const WeightedObservation& observation : problem.observations) {
    if (!chain.Residual(observation, residual_px)) {
      return std::numeric_limits<double>::infinity();
    }
    sum += residual_px.squaredNorm() / (observation.sigma_px * observation.sigma_px);
  }
  return sum;
}

PoseProblem Without(const PoseProblem& problem, const std::vector<std::size_t>& left_out) {
  PoseProblem rest{problem.camera, problem.unknowns, {}, problem.errors};
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (std::find(left_out.begin(), left_out.end(), i) != left_out.end()) {
      continue;
    }
    rest.observations.push_back(problem.observations[i]);
  }
  return rest;
}

PoseProblem InMiddleFrame(const PoseProblem& problem, const MiddleFrame& frame) {
  PoseProblem moved = problem;
  for (WeightedObservation& observation : moved.observations) {
    observation.part_mm = frame.turned * (observation.part_mm - frame.middle_mm);
  }
  return moved;
}

Theta FromMiddleFrame(const MiddleFrame& frame, const Theta& theta) {
  const Matrix3d rotation = RotationFromAngles(theta.segment<3>(3)) * frame.turned;
  Theta own = theta;
  own.head<3>() -= rotation * frame.middle_mm;
  own.segment<3>(3) = geometry::AnglesFromRotation(rotation);
  return own;
}

Theta ToMiddleFrame(const MiddleFrame& frame, const Theta& theta) {
  const Matrix3d rotation = RotationFromAngles(theta.segment<3>(3));
  Theta middle = theta;
  middle.head<3>() += rotation * frame.middle_mm;
  middle.segment<3>(3) = geometry::AnglesFromRotation(rotation * frame.turned.transpose());
  return middle;
}

MiddleFrame MiddleFrameOf(const PoseProblem& problem, const Matrix3d& machine_from_part) {
  MiddleFrame frame;
  frame.turned = machine_from_part;
  for (const WeightedObservation& observation : problem.observations) {
    frame.middle_mm += observation.part_mm / static_cast<double>(problem.observations.size());
  }
  return frame;
}

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
  constexpr double kMax_mm2 = 1e6;
  const auto rows = 3 * static_cast<Eigen::Index>(target_count);
  if (covariance.rows() != rows || covariance.cols() != rows) {
    return Fail(fmt::format("the targets' covariance is {} x {}, {} targets need {} x {}",
                            covariance.rows(), covariance.cols(), target_count, rows, rows));
  }
  if (!covariance.allFinite() || covariance.cwiseAbs().maxCoeff() > kMax_mm2) {
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
  const auto by_id = TRY(TargetsById(measurement.targets));
  PoseProblem problem{measurement.camera, unknowns, {}, {}};
  for (std::size_t number = 0; number < measurement.views.size(); ++number) {
    const View& view = measurement.views[number];
    TRY(CheckView(view, number));
    std::set<std::string> seen_here;
    for (const Observation& seen : view.observations) {
      const auto found = by_id.find(seen.target);
      if (found == by_id.end()) {
        return Fail(fmt::format("view {}: target {} is not among the {} targets of the part",
                                number + 1, seen.target, by_id.size()));
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
  constexpr std::size_t kMaxObservations = 20000;
  if (problem.observations.size() > kMaxObservations) {
    return Fail(fmt::format("{} observations, at most {} can be solved for at once",
                            problem.observations.size(), kMaxObservations));
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
  constexpr std::size_t kMaxUncertain = 300;  // 900 errors that observations share
  if ((options.target_covariance || target_mm > 0) && target_count > kMaxUncertain) {
    return Fail(
        fmt::format("{} targets are uncertain, at most {} can be counted: leave out what "
                    "is not seen{}",
                    target_count, kMaxUncertain,
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
  TRY(ValidateInputs(options, inputs.target_mm.value(), measurement.targets.size()));
  PoseProblem problem = TRY(MakeProblem(measurement, options.unknowns));
  problem.errors = ErrorsOf(inputs, options.unknowns, measurement.targets.size(),
                            options.target_covariance, options.camera_covariance);
  return problem;
}

}  // namespace trammel::part_alignment
