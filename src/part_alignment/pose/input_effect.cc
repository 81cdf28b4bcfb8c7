#include "part_alignment/pose/input_effect.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <string_view>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

const Unknowns kEverything{true, true, true, true, true};

}  // namespace

Result<void> Validate(const InputUncertainty& inputs) {
  struct Field {
    std::string_view name;
    double value;
  };
  const std::array fields{Field{"machine_mm", inputs.machine_mm},
                          Field{"target_mm", inputs.target_mm},
                          Field{"clamp_angle_rad", inputs.clamp_angle_rad},
                          Field{"clamp_eccentricity_mm", inputs.clamp_eccentricity_mm},
                          Field{"clamp_tilt_rad", inputs.clamp_tilt_rad},
                          Field{"focal_length_mm", inputs.focal_length_mm},
                          Field{"camera_offset_mm", inputs.camera_offset_mm}};
  for (const Field& field : fields) {
    if (!(field.value >= 0 && field.value <= 1000)) {
      return Fail(
          fmt::format("uncertainty {} is {}, it must lie in 0 ... 1000", field.name, field.value));
    }
  }
  return {};
}

Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns) {
  const Layout all = LayoutOf(kEverything);
  Theta sigmas = Theta::Zero(all.size);
  const auto set = [&](bool solved, int first, int count, double sigma) {
    sigmas.segment(first, count).setConstant(solved ? 0 : sigma);
  };
  set(unknowns.clamp_angle, all.clamp_angle, 1, inputs.clamp_angle_rad);
  set(unknowns.clamp_eccentricity, all.clamp_eccentricity, 2, inputs.clamp_eccentricity_mm);
  set(unknowns.clamp_tilt, all.clamp_tilt, 2, inputs.clamp_tilt_rad);
  set(unknowns.focal_length, all.focal_length, 1, inputs.focal_length_mm);
  set(unknowns.camera_offset, all.camera_offset, 3, inputs.camera_offset_mm);
  return sigmas;
}

PoseProblem WithEverything(const PoseProblem& problem) {
  PoseProblem all = problem;
  all.unknowns = kEverything;
  return all;
}

Theta EverythingAt(const PoseProblem& problem, const Theta& theta) {
  const PoseProblem all = WithEverything(problem);
  Theta everything = ThetaOf(all, PoseOf(theta), ClampingOf(LayoutOf(problem.unknowns), theta));
  const Layout from = LayoutOf(problem.unknowns);
  const Layout to = LayoutOf(all.unknowns);
  if (from.focal_length >= 0) {
    everything[to.focal_length] = theta[from.focal_length];
  }
  if (from.camera_offset >= 0) {
    everything.segment<3>(to.camera_offset) = theta.segment<3>(from.camera_offset);
  }
  return everything;
}

CameraCovariance CountingRoot(const Unknowns& unknowns, const CameraCovariance& covariance) {
  CameraCovariance root = geometry::CovarianceRoot(covariance);
  if (unknowns.focal_length) {
    root.row(0).setZero();
  }
  if (unknowns.camera_offset) {
    root.middleRows<3>(7).setZero();
  }
  return root;
}

namespace {

/// theta changes by this matrix times the change of the weighted residuals. Empty below full rank.
MatrixXd Gain(const PoseProblem& problem, const Theta& theta) {
  const MatrixXd jacobian = WeightedJacobian(problem, theta);
  if (jacobian.size() == 0 || jacobian.rows() < jacobian.cols()) {
    return {};
  }
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseInverse();
  const geometry::SingularValues of = geometry::DecomposeSingular(jacobian * scale.asDiagonal());
  constexpr double kSingular = 1e-9;
  if (!scale.allFinite() || of.values.minCoeff() < kSingular * of.values.maxCoeff()) {
    return {};
  }
  return scale.asDiagonal() * of.v * of.values.cwiseInverse().asDiagonal() * of.u.transpose();
}

/// What the inputs do to theta: a column for each independent draw, times its sigma.
MatrixXd InputMoves(const PoseProblem& problem, const Theta& theta, const InputUncertainty& inputs,
                    const MatrixXd& gain) {
  const Theta everything = EverythingAt(problem, theta);
  const MatrixXd jacobian = WeightedJacobian(WithEverything(problem), everything);
  const Eigen::Matrix3d turn = geometry::RotationFromAngles(everything.segment<3>(3));
  std::map<std::size_t, Index> views;
  std::map<std::size_t, Index> targets;
  for (const Sight& sight : problem.sights) {
    views.emplace(sight.view, static_cast<Index>(views.size()));
    targets.emplace(sight.target, static_cast<Index>(targets.size()));
  }
  const Index common = jacobian.cols() - 6;
  const Index first_target = 3 * static_cast<Index>(views.size());
  const Index first_common = first_target + 3 * static_cast<Index>(targets.size());
  MatrixXd moves = MatrixXd::Zero(theta.size(), first_common + common);
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const Index row = 2 * static_cast<Index>(i);
    const Sight& sight = problem.sights[i];
    const MatrixXd by_machine = gain.middleCols<2>(row) * jacobian.block<2, 3>(row, 0);
    moves.middleCols<3>(3 * views[sight.view]) -= inputs.machine_mm * by_machine;
    moves.middleCols<3>(first_target + 3 * targets[sight.target]) +=
        inputs.target_mm * by_machine * turn;
  }
  moves.rightCols(common) = gain * jacobian.rightCols(common) *
                            CommonSigmas(inputs, problem.unknowns).tail(common).asDiagonal();
  return moves;
}

}  // namespace

void WidenSigmas(const Theta& theta, const InputUncertainty& inputs, PoseProblem& problem) {
  const double shared_mm = std::hypot(inputs.machine_mm, inputs.target_mm);
  const Chain chain(problem, theta, true);
  Vector2d residual_px;
  SightDerivative derivative;
  for (Sight& sight : problem.sights) {
    sight.pixel_sigma_px = sight.sigma_px;
    if (shared_mm > 0 && chain.ResidualAndDerivative(sight, residual_px, derivative)) {
      const double px_per_mm = derivative.leftCols<3>().norm() / std::sqrt(2.0);
      sight.sigma_px = std::hypot(sight.sigma_px, px_per_mm * shared_mm);
    }
  }
}

std::vector<SharedMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                    const CameraCovariance& covariance) {
  const Layout layout = LayoutOf(problem.unknowns);
  Camera camera = problem.camera;
  if (layout.focal_length >= 0) {
    camera.focal_length_mm = theta[layout.focal_length];
  }
  if (layout.camera_offset >= 0) {
    camera.taper_from_camera.translation_mm = theta.segment<3>(layout.camera_offset);
  }
  const Eigen::Matrix3d rotation =
      geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
  const Clamping clamping = ClampingOf(layout, theta);
  const CameraCovariance root = CountingRoot(problem.unknowns, covariance);
  std::vector<SharedMove> moves;
  for (const Sight& sight : problem.sights) {
    const View view{sight.spindle_mm, sight.spindle_from_machine.transpose(), {}};
    const Eigen::Vector3d taper_mm =
        rotation * CameraFromPart(camera, clamping, view, PoseOf(theta), sight.part_mm) +
        camera.taper_from_camera.translation_mm;
    const auto projected = ProjectFromTaper(camera, taper_mm);
    moves.push_back(projected ? SharedMove(projected->by_parameter * root) : SharedMove::Zero());
  }
  return moves;
}

MatrixXd CovarianceByInputs(const PoseProblem& problem, const Theta& theta,
                            const InputUncertainty& inputs,
                            const std::optional<CameraCovariance>& camera) {
  const MatrixXd gain = Gain(problem, theta);
  if (gain.size() == 0) {
    return {};
  }
  MatrixXd by_pixels = gain;
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const Sight& sight = problem.sights[i];
    by_pixels.middleCols<2>(2 * static_cast<Index>(i)) *= sight.pixel_sigma_px / sight.sigma_px;
  }
  const MatrixXd moved = InputMoves(problem, theta, inputs, gain);
  MatrixXd covariance = by_pixels * by_pixels.transpose() + moved * moved.transpose();
  if (camera) {
    const std::vector<SharedMove> moves = CameraMoves(problem, theta, *camera);
    MatrixXd by_camera = MatrixXd::Zero(theta.size(), kCameraParameters);
    for (std::size_t i = 0; i < problem.sights.size(); ++i) {
      by_camera +=
          gain.middleCols<2>(2 * static_cast<Index>(i)) * moves[i] / problem.sights[i].sigma_px;
    }
    covariance += by_camera * by_camera.transpose();
  }
  return covariance;
}

}  // namespace trammel::part_alignment
