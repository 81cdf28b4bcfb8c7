#include "part_alignment/pose/input_effect.h"

#include <cmath>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

const Unknowns kEverything{true, true, true, true, true};

}  // namespace

Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns) {
  const Layout all = LayoutOf(kEverything);
  Theta sigmas = Theta::Zero(all.size);
  const auto set = [&](bool solved, int first, int count, double sigma) {
    sigmas.segment(first, count).setConstant(solved ? 0 : sigma);
  };
  set(unknowns.clamp_angle, all.clamp_angle, 1, inputs.clamp_angle_rad);
  set(unknowns.clamp_eccentricity, all.clamp_eccentricity, 2, inputs.clamp_eccentricity_mm.value());
  set(unknowns.clamp_tilt, all.clamp_tilt, 2, inputs.clamp_tilt_rad);
  set(unknowns.focal_length, all.focal_length, 1, inputs.focal_length_mm);
  set(unknowns.camera_offset, all.camera_offset, 3, inputs.camera_offset_mm.value());
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

InputErrors ErrorsOf(const InputUncertainty& inputs, const Unknowns& unknowns,
                     std::size_t target_count, const std::optional<MatrixXd>& targets,
                     const std::optional<CameraCovariance>& camera) {
  InputErrors errors{inputs.machine_mm.value(), CommonSigmas(inputs, unknowns), {}, {}};
  const auto rows = 3 * static_cast<Index>(target_count);
  const double alone_mm = inputs.target_mm.value();
  if (targets) {
    errors.targets =
        geometry::CovarianceRoot(*targets + alone_mm * alone_mm * MatrixXd::Identity(rows, rows));
  } else if (alone_mm > 0) {
    errors.targets = alone_mm * MatrixXd::Identity(rows, rows);
  }
  if (camera) errors.camera = CountingRoot(unknowns, *camera);
  return errors;
}

void InflateSigmas(const Theta& theta, PoseProblem& problem) {
  const InputErrors& errors = problem.errors;
  const Chain chain(problem, theta, true);
  Vector2d residual_px;
  ObservationDerivative derivative;
  for (WeightedObservation& observation : problem.observations) {
    observation.sigma_px = observation.pixel_sigma_px;
    double squares_mm2 = errors.machine_mm * errors.machine_mm;
    if (errors.targets.size() > 0) {
      squares_mm2 +=
          errors.targets.middleRows<3>(3 * static_cast<Index>(observation.target)).squaredNorm() /
          3;
    }
    if (squares_mm2 > 0 && chain.ResidualAndDerivative(observation, residual_px, derivative)) {
      const double px_per_mm = derivative.leftCols<3>().norm() / std::sqrt(2.0);
      observation.sigma_px =
          std::hypot(observation.pixel_sigma_px, px_per_mm * std::sqrt(squares_mm2));
    }
  }
}

std::vector<CameraMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                    const CameraCovariance& root) {
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
  std::vector<CameraMove> moves;
  for (const WeightedObservation& observation : problem.observations) {
    const View view{observation.spindle_mm, observation.spindle_from_machine.transpose(), {}};
    const Eigen::Vector3d taper_mm =
        rotation * CameraFromPart(camera, clamping, view, PoseOf(theta), observation.part_mm) +
        camera.taper_from_camera.translation_mm;
    const auto projected = ProjectFromTaper(camera, taper_mm);
    moves.push_back(projected ? CameraMove(projected->by_parameter.lazyProduct(root))
                              : CameraMove::Zero());
  }
  return moves;
}

}  // namespace trammel::part_alignment
