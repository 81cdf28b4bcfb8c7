#include "part_alignment/pose/view_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "part_alignment/pose/candidate_views.h"
#include "part_alignment/pose/observability.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// How far before the camera the targets lie, the middle one.
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
  auto middle = distances_mm.begin() + static_cast<std::ptrdiff_t>(distances_mm.size() / 2);
  std::nth_element(distances_mm.begin(), middle, distances_mm.end());
  return std::clamp(*middle, kNearest_mm, kFarthest_mm);
}

std::vector<Matrix3d> UsedOrientations(const PoseProblem& problem) {
  constexpr double kSame = 1e-3;
  constexpr std::size_t kMost = 6;
  std::vector<Matrix3d> orientations;
  for (const WeightedObservation& observation : problem.observations) {
    const Matrix3d orientation = observation.spindle_from_machine.transpose();
    const bool known =
        std::any_of(orientations.begin(), orientations.end(),
                    [&](const Matrix3d& other) { return (other - orientation).norm() < kSame; });
    if (!known && orientations.size() < kMost) {
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

/// The candidate that improves the weakest direction most; among equals the one that tells most.
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
  constexpr int kMostViews = 4;
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
  for (int i = 0; i < kMostViews && weakest_mm > limit_mm; ++i) {
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
