#include "part_alignment/pose/observability.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::string Join(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

/// Vector from the spindle's axis and nose to an observation's target, in spindle and machine
/// frame.
struct Lever {
  Vector3d spindle_mm;
  Vector3d machine_mm;
};

Lever LeverOf(const WeightedObservation& observation, const Theta& theta) {
  const geometry::Pose pose = PoseOf(theta);
  const Vector3d machine_mm = geometry::RotationFromAngles(pose.angles_rad) * observation.part_mm +
                              pose.translation_mm - observation.spindle_mm;
  Vector3d spindle_mm = observation.spindle_from_machine * machine_mm;
  Vector3d across = spindle_mm;
  across.z() = 0;
  return {spindle_mm, observation.spindle_from_machine.transpose() * across};
}

double Rms(double sum, std::size_t count) { return std::sqrt(sum / static_cast<double>(count)); }

/// Explains why the clamp angle is unobservable; empty if levers differ.
std::string WhyNoClampAngle(const PoseProblem& problem, const Theta& theta) {
  constexpr double kSameLever_mm = 1;
  std::map<std::size_t, std::vector<Vector3d>> levers;
  double longest_mm = 0;
  for (const WeightedObservation& observation : problem.observations) {
    const Vector3d lever = LeverOf(observation, theta).machine_mm;
    levers[observation.target].push_back(lever);
    longest_mm = std::max(longest_mm, lever.norm());
  }
  double spread_mm = 0;
  for (const auto& [target, own] : levers) {
    for (const Vector3d& lever : own) {
      spread_mm = std::max(spread_mm, (lever - own.front()).norm());
    }
  }
  if (longest_mm < kSameLever_mm) {
    return fmt::format("every target lies on the spindle's axis (within {:.2g} mm)", longest_mm);
  }
  if (spread_mm < kSameLever_mm) {
    return fmt::format(
        "no target is seen from two different positions of the spindle axis (they differ by {:.2g} "
        "mm, the targets lie up to {:.3g} mm from the axis)",
        spread_mm, longest_mm);
  }
  return fmt::format("the positions a target is seen from differ by {:.3g} mm at most", spread_mm);
}

bool SpindleTurns(const PoseProblem& problem) {
  const Eigen::Matrix3d& first = problem.observations.front().spindle_from_machine;
  return std::any_of(problem.observations.begin(), problem.observations.end(),
                     [&](const WeightedObservation& observation) {
                       return (observation.spindle_from_machine - first).norm() > 0.1;
                     });
}

/// Computes twice the largest distance from the targets' best line.
double Breadth(const PoseProblem& problem) {
  Eigen::Matrix3Xd points(3, static_cast<Index>(problem.observations.size()));
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    points.col(static_cast<Index>(i)) = problem.observations[i].part_mm;
  }
  points.colwise() -= points.rowwise().mean().eval();
  const Eigen::VectorXd lengths = geometry::DecomposeSingular(points).values;
  return lengths.size() > 1 ? 2 * lengths[1] : 0;
}

/// Computes the spread of the targets' distances from the spindle's nose, relative to their median.
double DistanceSpread(const PoseProblem& problem, const Theta& theta) {
  double min_mm = std::numeric_limits<double>::infinity();
  double max_mm = 0;
  for (const WeightedObservation& observation : problem.observations) {
    const double away_mm = LeverOf(observation, theta).spindle_mm.norm();
    min_mm = std::min(min_mm, away_mm);
    max_mm = std::max(max_mm, away_mm);
  }
  return max_mm > 0 ? 2 * (max_mm - min_mm) / (max_mm + min_mm) : 0;
}

/// Explains why a direction is unobservable or weak; empty without a simple reason.
std::string Why(const PoseProblem& problem, const Theta& theta, const std::vector<bool>& involved) {
  const Layout layout = LayoutOf(problem.unknowns);
  const int lines_needed = (layout.size + 1) / 2;
  std::set<std::size_t> targets;
  std::set<std::size_t> views;
  for (const WeightedObservation& observation : problem.observations) {
    targets.insert(observation.target);
    views.insert(observation.view);
  }
  const auto part_of = [&](int first, int count) {
    return first >= 0 && std::any_of(involved.begin() + first, involved.begin() + first + count,
                                     [](bool yes) { return yes; });
  };
  if (static_cast<int>(problem.observations.size()) < lines_needed) {
    return fmt::format("{} unknowns need at least {} lines of sight, there are {}", layout.size,
                       lines_needed, problem.observations.size());
  }
  if (targets.size() < 3) {
    return fmt::format("a part needs three targets, {} {} seen", targets.size(),
                       targets.size() == 1 ? "is" : "are");
  }
  if (Breadth(problem) < 1) {
    return "the targets lie on one line";
  }
  if (views.size() == 1 && layout.size > 6) {
    return "there is one view only";
  }
  if (part_of(layout.clamp_eccentricity, 2) || part_of(layout.camera_offset, 3)) {
    return SpindleTurns(problem) ? "the spindle's orientations do not tell them apart"
                                 : "all views have the same orientation of the spindle";
  }
  if (part_of(layout.clamp_angle, 1)) {
    return WhyNoClampAngle(problem, theta);
  }
  if (part_of(layout.clamp_tilt, 2) || part_of(layout.focal_length, 1)) {
    return fmt::format("the distances from spindle to target differ by {:.2g} %",
                       100 * DistanceSpread(problem, theta));
  }
  return {};
}

/// Converts to a basis of the same space whose vectors each have one unknown that the others lack
/// (Gauss's elimination with pivots). Two separate problems are then reported separately.
Eigen::MatrixXd Separated(Eigen::MatrixXd directions) {
  for (Index k = 0; k < directions.cols(); ++k) {
    Index row = 0;
    Index column = 0;
    directions.rightCols(directions.cols() - k).cwiseAbs().maxCoeff(&row, &column);
    directions.col(k).swap(directions.col(k + column));
    directions.col(k) /= directions(row, k);
    for (Index other = 0; other < directions.cols(); ++other) {
      if (other != k) {
        directions.col(other) -= (directions(row, other) * directions.col(k)).eval();
      }
    }
  }
  return directions.colwise().normalized();
}

/// Names the unknowns in a direction that cannot be separated.
/// @param seen  the direction is known, but not well enough
std::string NamesText(const std::vector<std::string>& names, const std::vector<bool>& involved,
                      bool seen) {
  std::vector<std::string> part;
  std::vector<std::string> clamping;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (involved[i]) {
      (i < 6 ? part : clamping).push_back(names[i]);
    }
  }
  const char* cannot = seen ? "cannot be told well enough" : "cannot be told";
  if (!part.empty() && !clamping.empty()) {
    return fmt::format("{} {} from {}", Join(clamping), cannot, Join(part));
  }
  const std::vector<std::string>& all = part.empty() ? clamping : part;
  if (all.size() > 1) return fmt::format("{} {} apart", Join(all), cannot);
  return fmt::format("{} is not {}", all[0], seen ? "known well enough" : "seen");
}

/// @param weak  directions known worse than the limit, the weakest last.
std::string Words(const PoseProblem& problem, const Theta& theta, const Eigen::MatrixXd& weak,
                  double weakest_sigma_mm, double limit_mm) {
  constexpr double kNotable = 0.3;
  const std::vector<std::string> names = UnknownNames(problem.unknowns);
  const Eigen::MatrixXd directions = Separated(weak);
  std::string text;
  std::string last_why;
  for (Index k = 0; k < directions.cols(); ++k) {
    const double most = directions.col(k).cwiseAbs().maxCoeff();
    std::vector<bool> involved(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      involved[i] = std::abs(directions(static_cast<Index>(i), k)) > kNotable * most;
    }
    const std::string why = Why(problem, theta, involved);
    text += fmt::format("{}{}{}", text.empty() ? "" : "; ",
                        NamesText(names, involved, std::isfinite(weakest_sigma_mm)),
                        why.empty() || why == last_why ? "" : ": " + why);
    last_why = why;
  }
  if (std::isfinite(weakest_sigma_mm)) {
    text += fmt::format(" (known to {:.3g} mm along it, {:.3g} mm are asked for)", weakest_sigma_mm,
                        limit_mm);
  }
  return text;
}

/// Computes singular values and right vectors of the Jacobian with scaled columns.
geometry::SingularValues Decompose(const PoseProblem& problem, const Theta& theta,
                                   const Theta& units) {
  Eigen::MatrixXd jacobian = WeightedJacobian(problem, theta) * units.asDiagonal();
  if (jacobian.rows() < jacobian.cols()) {
    const Index rows = jacobian.rows();
    jacobian.conservativeResize(jacobian.cols(), Eigen::NoChange);
    jacobian.bottomRows(jacobian.rows() - rows).setZero();
  }
  return geometry::DecomposeSingular(jacobian);
}

}  // namespace

Theta UnitsPerMillimetre(const PoseProblem& middle_problem, const Theta& theta) {
  constexpr double kShortest_mm = 10;  // below it a lever counts as this long
  const Layout layout = LayoutOf(middle_problem.unknowns);
  const std::size_t count = middle_problem.observations.size();
  Vector3d around = Vector3d::Zero();
  double across2 = 0;
  double along2 = 0;
  for (const WeightedObservation& observation : middle_problem.observations) {
    around +=
        Vector3d::Constant(observation.part_mm.squaredNorm()) - observation.part_mm.cwiseAbs2();
    const Vector3d spindle_mm = LeverOf(observation, theta).spindle_mm;
    across2 += spindle_mm.head<2>().squaredNorm();
    along2 += spindle_mm.squaredNorm();
  }
  const double across_mm = std::max(kShortest_mm, Rms(across2, count));
  const double along_mm = std::max(kShortest_mm, Rms(along2, count));
  Theta units = Theta::Ones(layout.size);
  for (int i = 0; i < 3; ++i) {
    units[3 + i] = 1 / std::max(kShortest_mm, Rms(around[i], count));
  }
  if (layout.clamp_angle >= 0) {
    units[layout.clamp_angle] = 1 / across_mm;
  }
  if (layout.clamp_tilt >= 0) {
    units.segment<2>(layout.clamp_tilt).setConstant(1 / along_mm);
  }
  if (layout.focal_length >= 0) {
    units[layout.focal_length] = middle_problem.camera.focal_length_mm / along_mm;
  }
  return units;
}

Observability Observe(const PoseProblem& middle_problem, const Theta& theta, double limit_mm) {
  const Theta units = UnitsPerMillimetre(middle_problem, theta);
  const geometry::SingularValues of = Decompose(middle_problem, theta, units);
  Observability seen;
  seen.unknowns = static_cast<int>(theta.size());
  seen.rank = static_cast<int>((of.values.array() > 1 / kUnseen_mm).count());
  const Index last = of.values.size() - 1;
  const bool full = seen.rank == seen.unknowns;
  seen.weakest = of.v.col(last);
  seen.weakest_sigma_mm = full ? 1 / of.values[last] : std::numeric_limits<double>::infinity();
  if (seen.weakest_sigma_mm > limit_mm) {
    const Index weak = (of.values.array() < 1 / limit_mm).count();
    seen.words =
        Words(middle_problem, theta, of.v.rightCols(weak), seen.weakest_sigma_mm, limit_mm);
  }
  return seen;
}

}  // namespace trammel::part_alignment
