#include "part_alignment/pose/candidate_views.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// How the camera sits in the spindle, at theta.
struct Mounting {
  Camera camera;
  Matrix3d spindle_from_camera;
  Vector3d origin_mm;  // of the camera, spindle frame
};

Mounting MountingOf(const PoseProblem& problem, const Theta& theta) {
  const Layout layout = LayoutOf(problem.unknowns);
  const Clamping clamping = ClampingOf(layout, theta);
  Mounting mounting;
  mounting.camera = problem.camera;
  if (layout.focal_length >= 0) {
    mounting.camera.focal_length_mm = theta[layout.focal_length];
  }
  if (layout.camera_offset >= 0) {
    mounting.camera.taper_from_camera.translation_mm = theta.segment<3>(layout.camera_offset);
  }
  const Matrix3d clamped = geometry::RotationFromAngles({0, 0, -clamping.angle_rad}) *
                           geometry::RotationFromAngles({clamping.tilt_rad.x(), 0, 0}) *
                           geometry::RotationFromAngles({0, clamping.tilt_rad.y(), 0});
  const geometry::Pose& taper = mounting.camera.taper_from_camera;
  mounting.spindle_from_camera = clamped * geometry::RotationFromAngles(taper.angles_rad);
  mounting.origin_mm = clamped * taper.translation_mm;
  mounting.origin_mm.head<2>() += clamping.eccentricity_mm;
  return mounting;
}

/// Nine places in the picture.
std::vector<Vector2d> Places(const Camera& camera, double field_share) {
  const Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  std::vector<Vector2d> places;
  for (const double row : {0.0, -1.0, 1.0}) {
    for (const double column : {0.0, -1.0, 1.0}) {
      places.emplace_back(centre + field_share * Vector2d(column, row).cwiseProduct(centre));
    }
  }
  return places;
}

bool InField(const Camera& camera, const Vector2d& pixel, double field_share) {
  constexpr double kRounding_px = 1e-6;  // a target aimed at the field's edge is in it
  const Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  return ((pixel - centre).cwiseAbs() - field_share * centre).maxCoeff() <= kRounding_px;
}

/// Fills what the view sees and tells.
void Inform(const Chain& chain, const Camera& camera, const Theta& units,
            const std::vector<Vector3d>& targets_mm, const CandidateOptions& options,
            CandidateView& view) {
  view.information.setZero(units.size(), units.size());
  WeightedObservation observation;
  observation.spindle_from_machine = view.spindle_rotation.transpose();
  observation.spindle_mm = view.spindle_mm;
  ObservationDerivative derivative;
  for (std::size_t i = 0; i < targets_mm.size(); ++i) {
    observation.part_mm = targets_mm[i];
    Vector2d minus_pixel;
    if (!chain.ResidualAndDerivative(observation, minus_pixel, derivative) ||
        !InField(camera, -minus_pixel, options.field_share)) {
      continue;
    }
    view.seen.push_back(i);
    const ObservationDerivative scaled = derivative * units.asDiagonal() / options.sigma_px;
    view.information.noalias() += scaled.transpose().lazyProduct(scaled);
  }
}

}  // namespace

std::vector<CandidateView> CandidateViews(const PoseProblem& problem, const Theta& theta,
                                          const Theta& units,
                                          const std::vector<Vector3d>& targets_mm,
                                          const CandidateOptions& options) {
  const Mounting mounting = MountingOf(problem, theta);
  const Chain chain(problem, theta, true);
  const geometry::Pose pose = PoseOf(theta);
  const Matrix3d machine_from_part = geometry::RotationFromAngles(pose.angles_rad);
  std::vector<CandidateView> views;
  for (std::size_t target = 0; target < targets_mm.size(); ++target) {
    const Vector3d machine_mm = machine_from_part * targets_mm[target] + pose.translation_mm;
    for (const Matrix3d& orientation : options.orientations) {
      for (const Vector2d& place : Places(mounting.camera, options.field_share)) {
        const auto line = LineOfSight(mounting.camera, place);
        if (!line) {
          continue;
        }
        const Vector3d seen_mm = *line * (options.distance_mm / std::abs(line->z()));
        CandidateView view;
        view.spindle_rotation = orientation;
        view.spindle_mm = machine_mm - orientation * (mounting.spindle_from_camera * seen_mm +
                                                      mounting.origin_mm);
        view.aimed_at = target;
        Inform(chain, mounting.camera, units, targets_mm, options, view);
        if (std::find(view.seen.begin(), view.seen.end(), target) != view.seen.end()) {
          views.push_back(view);
        }
      }
    }
  }
  return views;
}

double WeakestSigma(const ThetaMatrix& information) {
  constexpr double kMost_mm = 1e6;
  const double least = geometry::SymmetricEigenvalues(information)[0];
  return least > 1 / (kMost_mm * kMost_mm) ? 1 / std::sqrt(least) : kMost_mm;
}

double LogDeterminant(const ThetaMatrix& information) {
  constexpr double kPrior = 1e-6;  // per mm²
  ThetaMatrix with_prior = information;
  with_prior.diagonal().array() += kPrior;
  return with_prior.ldlt().vectorD().array().max(1e-300).log().sum();
}

}  // namespace trammel::part_alignment
