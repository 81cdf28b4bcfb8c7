#include "part_alignment/pose/view_advice.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "part_alignment/pose/observability.h"

namespace trammel::part_alignment {
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Mounting of the camera in the spindle, at theta.
struct Mounting {
  Camera camera;
  Matrix3d spindle_from_camera;
  Vector3d origin_mm;  // camera origin, spindle frame
};

Mounting MountingOf(const PoseProblem& problem, const Theta& theta) {
  const Clamping clamping = ClampingOf(LayoutOf(problem.unknowns), theta);
  Mounting mounting;
  mounting.camera = CameraOf(problem, theta);
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

/// Fills in the targets that the view sees, and its information.
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
  constexpr double kMax_mm = 1e6;
  const double least = geometry::SymmetricEigenvalues(information)[0];
  return least > 1 / (kMax_mm * kMax_mm) ? 1 / std::sqrt(least) : kMax_mm;
}

double LogDeterminant(const ThetaMatrix& information) {
  constexpr double kPrior = 1e-6;  // per mm²
  ThetaMatrix with_prior = information;
  with_prior.diagonal().array() += kPrior;
  return with_prior.ldlt().vectorD().array().max(1e-300).log().sum();
}

namespace {

/// Returns the targets' median distance before the camera.
double UsualDistance(const PoseProblem& problem, const Theta& theta) {
  constexpr double kNearest_mm = 20;
  constexpr double kFarthest_mm = 10000;
  const Clamping clamping = ClampingOf(LayoutOf(problem.unknowns), theta);
  std::vector<double> distances_mm;
  for (const WeightedObservation& observation : problem.observations) {
    const View view{observation.spindle_mm, observation.spindle_from_machine.transpose(), {}};
    distances_mm.push_back(std::abs(
        CameraFromPart(problem.camera, clamping, view, PoseOf(theta), observation.part_mm).z()));
  }
  return std::clamp(Median(distances_mm), kNearest_mm, kFarthest_mm);
}

std::vector<Matrix3d> UsedOrientations(const PoseProblem& problem) {
  constexpr double kSame = 1e-3;
  constexpr std::size_t kMax = 6;
  std::vector<Matrix3d> orientations;
  for (const WeightedObservation& observation : problem.observations) {
    const Matrix3d orientation = observation.spindle_from_machine.transpose();
    const bool known =
        std::any_of(orientations.begin(), orientations.end(),
                    [&](const Matrix3d& other) { return (other - orientation).norm() < kSame; });
    if (!known && orientations.size() < kMax) {
      orientations.push_back(orientation);
    }
  }
  return orientations;
}

struct Choice {
  std::size_t index = 0;
  ThetaMatrix information;
  double weakest_mm = 0;
};

/// Returns the candidate that improves the weakest direction most; among equals the one of most
/// information.
Choice Best(const std::vector<CandidateView>& candidates, const ThetaMatrix& information) {
  constexpr double kAsGood = 0.99;
  Choice best;
  double best_logarithm = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const ThetaMatrix with = information + candidates[i].information;
    const double weakest_mm = WeakestSigma(with);
    const double logarithm = LogDeterminant(with);
    const bool better = weakest_mm < kAsGood * best.weakest_mm ||
                        (weakest_mm * kAsGood <= best.weakest_mm && logarithm > best_logarithm);
    if (best.information.size() == 0 || better) {
      best = {i, with, weakest_mm};
      best_logarithm = logarithm;
    }
  }
  return best;
}

std::string Describe(const CandidateView& view, const std::vector<PartTarget>& targets,
                     const std::vector<Matrix3d>& used) {
  const bool turned = std::none_of(used.begin(), used.end(), [&](const Matrix3d& orientation) {
    return (orientation - view.spindle_rotation).norm() < 1e-6;
  });
  return fmt::format("target {} from spindle X {:.1f} Y {:.1f} Z {:.1f}{}",
                     targets[view.aimed_at].id, view.spindle_mm.x(), view.spindle_mm.y(),
                     view.spindle_mm.z(),
                     turned ? " with the spindle turned by 180 degrees about its axis" : "");
}

}  // namespace

std::string AdviseViews(const PoseProblem& problem, const Theta& theta,
                        const std::vector<PartTarget>& targets, double limit_mm) {
  constexpr int kMaxViews = 4;
  const Layout layout = LayoutOf(problem.unknowns);
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(theta.segment<3>(3)));
  const PoseProblem middle = InMiddleFrame(problem, frame);
  const Theta middle_theta = ToMiddleFrame(frame, theta);
  const Theta units = UnitsPerMillimetre(middle, middle_theta);
  std::vector<Vector3d> targets_mm;
  for (const PartTarget& target : targets) {
    targets_mm.push_back(frame.turned * (target.ideal_mm - frame.middle_mm));
  }
  const std::vector<Matrix3d> used = UsedOrientations(problem);
  CandidateOptions options;
  options.distance_mm = UsualDistance(problem, theta);
  options.sigma_px = problem.observations.front().sigma_px;
  options.orientations = used;
  if (layout.clamp_eccentricity >= 0 || layout.camera_offset >= 0) {
    for (const Matrix3d& orientation : used) {
      options.orientations.push_back(orientation *
                                     geometry::RotationFromAngles({0, 0, std::numbers::pi}));
    }
  }
  std::vector<CandidateView> candidates =
      CandidateViews(middle, middle_theta, units, targets_mm, options);
  if (layout.size > 7) {
    options.distance_mm *= 1.5;
    const auto farther = CandidateViews(middle, middle_theta, units, targets_mm, options);
    candidates.insert(candidates.end(), farther.begin(), farther.end());
  }
  const Eigen::MatrixXd jacobian = WeightedJacobian(middle, middle_theta) * units.asDiagonal();
  if (candidates.empty() || jacobian.size() == 0) {
    return "add a view of another target from another place";
  }
  ThetaMatrix information = jacobian.transpose() * jacobian;
  std::string text;
  double weakest_mm = WeakestSigma(information);
  for (int i = 0; i < kMaxViews && weakest_mm > limit_mm; ++i) {
    const Choice choice = Best(candidates, information);
    information = choice.information;
    weakest_mm = choice.weakest_mm;
    text += (i == 0 ? "add a view of " : ", then of ") +
            Describe(candidates[choice.index], targets, used);
  }
  if (weakest_mm > kUnseen_mm) {
    return "no further view with the spindle pointing as it does would tell it: solve for fewer "
           "unknowns, or see the targets with the spindle tilted";
  }
  return fmt::format("{}: the weakest direction is then known to {:.2g} mm", text, weakest_mm);
}

}  // namespace trammel::part_alignment
