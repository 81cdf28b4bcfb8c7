#include "part_alignment/pose/pose_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::part_alignment {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::RotationDerivative;
using geometry::RotationFromAngles;

Layout LayoutOf(const Unknowns& unknowns) {
  Layout layout;
  const auto take = [&](bool asked, int count) {
    const int first = layout.size;
    layout.size += asked ? count : 0;
    return asked ? first : -1;
  };
  layout.clamp_angle = take(unknowns.clamp_angle, 1);
  layout.clamp_eccentricity = take(unknowns.clamp_eccentricity, 2);
  layout.clamp_tilt = take(unknowns.clamp_tilt, 2);
  layout.focal_length = take(unknowns.focal_length, 1);
  layout.camera_offset = take(unknowns.camera_offset, 3);
  return layout;
}

std::vector<std::string> ParameterNames(const Unknowns& unknowns) {
  std::vector<std::string> names{"x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad"};
  const auto add = [&](bool asked, std::initializer_list<const char*> more) {
    if (asked) {
      names.insert(names.end(), more.begin(), more.end());
    }
  };
  add(unknowns.clamp_angle, {"clamp_angle_rad"});
  add(unknowns.clamp_eccentricity, {"clamp_eccentricity_x_mm", "clamp_eccentricity_y_mm"});
  add(unknowns.clamp_tilt, {"clamp_tilt_x_rad", "clamp_tilt_y_rad"});
  add(unknowns.focal_length, {"focal_length_mm"});
  add(unknowns.camera_offset, {"camera_offset_x_mm", "camera_offset_y_mm", "camera_offset_z_mm"});
  return names;
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
    : layout_(LayoutOf(problem.unknowns)), camera_(problem.camera) {
  if (layout_.focal_length >= 0) {
    camera_.focal_length_mm = theta[layout_.focal_length];
  }
  if (layout_.camera_offset >= 0) {
    camera_.taper_from_camera.translation_mm = theta.segment<3>(layout_.camera_offset);
  }
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
  // The angle enters as Rz(-angle): equation 27 with its element (3, 3) put right to 0.
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

}  // namespace trammel::part_alignment
