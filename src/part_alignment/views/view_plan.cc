#include "part_alignment/views/view_plan.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "part_alignment/pose/observability.h"
#include "part_alignment/pose/view_advice.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d Corner(const MachineBox& box, int i) {
  return {(i & 1) != 0 ? box.high_mm.x() : box.low_mm.x(),
          (i & 2) != 0 ? box.high_mm.y() : box.low_mm.y(),
          (i & 4) != 0 ? box.high_mm.z() : box.low_mm.z()};
}

Result<void> CheckBox(const std::string& name, const MachineBox& box) {
  if (!box.low_mm.allFinite() || !box.high_mm.allFinite() ||
      !((box.high_mm - box.low_mm).array() >= 0).all()) {
    return Fail(
        fmt::format("{}: from ({}, {}, {}) to ({}, {}, {}) mm is no box: give its lower "
                    "corner first",
                    name, box.low_mm.x(), box.low_mm.y(), box.low_mm.z(), box.high_mm.x(),
                    box.high_mm.y(), box.high_mm.z()));
  }
  return {};
}

Result<void> CheckNumbers(const ViewPlanOptions& options) {
  struct Field {
    const char* name;
    double value;
    double low;
    double high;
  };
  const std::array fields{
      Field{"working_distance_mm", options.working_distance_mm, 20, 10000},
      Field{"field_share", options.field_share, 0.1, 1},
      Field{"sigma_px", options.sigma_px, 1e-6, 100},
      Field{"clearance_mm", options.clearance_mm, 0, 1000},
      Field{"tool_length_mm", options.tool_length_mm, 0, 10000},
      Field{"tool_radius_mm", options.tool_radius_mm, 0, 10000},
      Field{"observations_per_target", double(options.observations_per_target), 1, 10},
      Field{"weakest_goal_mm", options.weakest_goal_mm, 1e-4, 10},
      Field{"most_views", double(options.max_views), 1, 200}};
  for (const Field& field : fields) {
    if (!(field.value >= field.low && field.value <= field.high)) {
      return Fail(fmt::format("plan: {} is {}, it must lie in {} ... {}", field.name, field.value,
                              field.low, field.high));
    }
  }
  return {};
}

Result<void> CheckOrientations(const std::vector<Matrix3d>& orientations) {
  constexpr double kSame = 1e-6;
  if (orientations.empty() || orientations.size() > 100) {
    return Fail(fmt::format("plan: {} orientations of the spindle, 1 ... 100 are allowed",
                            orientations.size()));
  }
  for (const Matrix3d& rotation : orientations) {
    const double off = (rotation * rotation.transpose() - Matrix3d::Identity()).norm();
    if (!(off <= kSame) || !(rotation.determinant() > 0)) {
      return Fail("plan: an orientation of the spindle is no rotation");
    }
    if (!((rotation.col(2) - orientations[0].col(2)).norm() <= kSame)) {
      return Fail(
          "plan: the orientations differ in the direction of the spindle's axis, and no way "
          "between "
          "them is known to be clear: plan each direction by itself");
    }
  }
  return {};
}

Result<void> CheckTargets(const std::vector<PartTarget>& targets, const geometry::Pose& pose) {
  constexpr double kFarthest_mm = 1e6;
  constexpr std::size_t kMaxTargets = 500;
  if (targets.empty() || targets.size() > kMaxTargets) {
    return Fail(fmt::format("plan: {} targets, 1 ... {} are allowed", targets.size(), kMaxTargets));
  }
  std::set<std::string> ids;
  for (const PartTarget& target : targets) {
    if (!(target.ideal_mm.cwiseAbs().maxCoeff() <= kFarthest_mm)) {
      return Fail(fmt::format("target {}: its coordinates must lie within +-{} mm", target.id,
                              kFarthest_mm));
    }
    if (!ids.insert(target.id).second) {
      return Fail(fmt::format("target {} is given twice", target.id));
    }
  }
  if (!(pose.translation_mm.cwiseAbs().maxCoeff() <= kFarthest_mm) ||
      !pose.angles_rad.allFinite()) {
    return Fail("plan: the rough place of the part is not finite or farther than 1e6 mm");
  }
  return {};
}

Result<void> Check(const Camera& camera, const std::vector<PartTarget>& targets,
                   const geometry::Pose& pose, const ViewPlanOptions& options) {
  Result<void> valid = Validate(camera);
  valid = valid ? CheckNumbers(options) : valid;
  valid = valid ? CheckBox("plan: travel", options.travel) : valid;
  for (std::size_t i = 0; i < options.obstacles.size() && valid; ++i) {
    valid = CheckBox(fmt::format("plan: obstacle {}", i), options.obstacles[i]);
  }
  valid = valid ? CheckOrientations(options.orientations) : valid;
  return valid ? CheckTargets(targets, pose) : valid;
}

/// State of the choice: the part in its middle frame, and the candidates that the machine allows.
struct Choosing {
  PoseProblem problem;  ///< observations of the chosen views
  Theta theta;
  Theta units;
  std::vector<Vector3d> targets_mm;
  std::vector<CandidateView> candidates;
  std::size_t before_room = 0;  ///< candidates before travel and obstacles
  ThetaMatrix information;
  std::vector<int> observations;  ///< so far, by target
};

WeightedObservation ObservationOf(const CandidateView& view, std::size_t target,
                                  const Vector3d& part_mm, double sigma_px) {
  WeightedObservation observation;
  observation.part_mm = part_mm;
  observation.spindle_from_machine = view.spindle_rotation.transpose();
  observation.spindle_mm = view.spindle_mm;
  observation.sigma_px = sigma_px;
  observation.target = target;
  return observation;
}

Choosing Prepare(const Camera& camera, const std::vector<PartTarget>& targets,
                 const geometry::Pose& pose, const ViewPlanOptions& options) {
  Choosing choosing;
  choosing.problem = {camera, options.unknowns, {}};
  MiddleFrame frame;
  frame.turned = geometry::RotationFromAngles(pose.angles_rad);
  for (const PartTarget& target : targets) {
    frame.middle_mm += target.ideal_mm / static_cast<double>(targets.size());
  }
  for (const PartTarget& target : targets) {
    choosing.targets_mm.push_back(frame.turned * (target.ideal_mm - frame.middle_mm));
  }
  choosing.theta = ToMiddleFrame(frame, ThetaOf(choosing.problem, pose, {}));
  const CandidateOptions candidate_options{options.working_distance_mm, options.field_share,
                                           options.sigma_px, options.orientations};
  // Once for the units, which follow from all candidates' observations, and once for the
  // information.
  PoseProblem all = choosing.problem;
  for (const CandidateView& view :
       CandidateViews(all, choosing.theta, Theta::Ones(choosing.theta.size()), choosing.targets_mm,
                      candidate_options)) {
    all.observations.push_back(
        ObservationOf(view, view.aimed_at, choosing.targets_mm[view.aimed_at], options.sigma_px));
  }
  if (all.observations.empty()) {
    return choosing;
  }
  choosing.units = UnitsPerMillimetre(all, choosing.theta);
  choosing.candidates = CandidateViews(choosing.problem, choosing.theta, choosing.units,
                                       choosing.targets_mm, candidate_options);
  choosing.before_room = choosing.candidates.size();
  const double tool_mm = ToolLength(camera, options.tool_length_mm);
  std::erase_if(choosing.candidates, [&](const CandidateView& view) {
    return !WithinTravel(options, view.spindle_mm) ||
           !ClearOfObstacles(options, tool_mm, view.spindle_mm, view.spindle_rotation);
  });
  choosing.information = ThetaMatrix::Zero(choosing.theta.size(), choosing.theta.size());
  choosing.observations.assign(targets.size(), 0);
  return choosing;
}

/// Names the unknown with the largest part in the weakest direction.
std::string WeakestName(const Choosing& choosing) {
  const Eigen::MatrixXd directions = geometry::DecomposeSymmetric(choosing.information).vectors;
  Eigen::Index largest = 0;
  directions.col(0).cwiseAbs().maxCoeff(&largest);
  return UnknownNames(choosing.problem.unknowns)[static_cast<std::size_t>(largest)];
}

/// Returns the index of the candidate with the most information, among those that see a target of
/// which `wanted` is true. The number of candidates if there is none.
std::size_t Best(const Choosing& choosing, const std::vector<bool>& wanted) {
  std::size_t best = choosing.candidates.size();
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < choosing.candidates.size(); ++i) {
    const CandidateView& view = choosing.candidates[i];
    const bool useful = std::any_of(view.seen.begin(), view.seen.end(),
                                    [&](std::size_t target) { return wanted[target]; });
    const double tells =
        useful ? LogDeterminant(choosing.information + view.information) : -INFINITY;
    if (tells > most) {
      most = tells;
      best = i;
    }
  }
  return best;
}

/// Describes half of the 95 % interval.
std::string Known(double sigma_mm) {
  return sigma_mm < kUnseen_mm ? fmt::format("within {:.2g} mm", kNormal95 * sigma_mm) : "unknown";
}

/// Adds the candidate to the plan, with its reason.
void Take(std::size_t index, const std::string& purpose, const std::vector<PartTarget>& targets,
          double sigma_px, Choosing& choosing, ViewPlan& plan) {
  const CandidateView& view = choosing.candidates[index];
  const double before_mm = WeakestSigma(choosing.information);
  const std::string weakest = WeakestName(choosing);
  choosing.information += view.information;
  const double after_mm = WeakestSigma(choosing.information);
  PlannedView planned{view.spindle_mm, view.spindle_rotation, {targets[view.aimed_at].id}, {}};
  for (const std::size_t target : view.seen) {
    ++choosing.observations[target];
    choosing.problem.observations.push_back(
        ObservationOf(view, target, choosing.targets_mm[target], sigma_px));
    choosing.problem.observations.back().view = plan.views.size();
    if (target != view.aimed_at) {
      planned.targets.push_back(targets[target].id);
    }
  }
  planned.why = fmt::format("{}; weakest direction (mostly {}), 95 %: {} before, {} after", purpose,
                            weakest, Known(before_mm), Known(after_mm));
  plan.views.push_back(planned);
}

/// Selects the views greedily; returns the shortfall, empty if there is none.
std::string Choose(const std::vector<PartTarget>& targets, const ViewPlanOptions& options,
                   Choosing& choosing, ViewPlan& plan) {
  const auto full = [&] { return static_cast<int>(plan.views.size()) >= options.max_views; };
  for (int round = 1; round <= options.observations_per_target; ++round) {
    for (;;) {
      std::vector<bool> wanted(targets.size());
      for (std::size_t i = 0; i < targets.size(); ++i) {
        wanted[i] = choosing.observations[i] < round;
      }
      const auto short_of = std::find(wanted.begin(), wanted.end(), true);
      if (short_of == wanted.end()) {
        break;
      }
      const std::string id = targets[static_cast<std::size_t>(short_of - wanted.begin())].id;
      const std::size_t best = full() ? choosing.candidates.size() : Best(choosing, wanted);
      if (best == choosing.candidates.size()) {
        return full() ? fmt::format("{} views are not enough to see each target {} times",
                                    options.max_views, options.observations_per_target)
                      : fmt::format(
                            "target {} cannot be seen from within the travel, clear of the "
                            "obstacles",
                            id);
      }
      const std::string& aimed = targets[choosing.candidates[best].aimed_at].id;
      Take(best,
           fmt::format("observation {} of {} of target {}", round, options.observations_per_target,
                       aimed),
           targets, options.sigma_px, choosing, plan);
    }
  }
  const std::vector<bool> any(targets.size(), true);
  constexpr int kUseless = 3;  // so many views on, what is not seen at all is never seen
  int useless = 0;
  while (WeakestSigma(choosing.information) > options.weakest_goal_mm && !full() &&
         useless < kUseless) {
    Take(Best(choosing, any), "for the weakest direction", targets, options.sigma_px, choosing,
         plan);
    useless += WeakestSigma(choosing.information) > kUnseen_mm ? 1 : 0;
  }
  return {};
}

/// Orders the views by short paths: the next is the nearest not yet taken.
void Order(ViewPlan& plan) {
  for (std::size_t i = 1; i < plan.views.size(); ++i) {
    const Vector3d& here = plan.views[i - 1].spindle_mm;
    const auto nearest =
        std::min_element(plan.views.begin() + static_cast<std::ptrdiff_t>(i), plan.views.end(),
                         [&](const PlannedView& a, const PlannedView& b) {
                           return (a.spindle_mm - here).norm() < (b.spindle_mm - here).norm();
                         });
    std::iter_swap(plan.views.begin() + static_cast<std::ptrdiff_t>(i), nearest);
  }
}

/// Returns the spindle point's height along the spindle's axis at which the tool's end passes
/// everything; minus infinity without obstacles.
double SafeHeight(const ViewPlanOptions& options, double tool_length_mm, const Vector3d& axis) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const MachineBox& obstacle : options.obstacles) {
    for (int i = 0; i < 8; ++i) {
      highest = std::max(highest, axis.dot(Corner(obstacle, i)));
    }
  }
  return highest + tool_length_mm + options.clearance_mm;
}

/// Fills in the plan's way through its views in their order; false and a reason if the safe plane
/// is outside the travel.
bool FillWay(const ViewPlanOptions& options, double tool_length_mm, ViewPlan& plan) {
  const Vector3d axis = plan.views.front().spindle_rotation.col(2);
  double height = SafeHeight(options, tool_length_mm, axis);
  for (const PlannedView& view : plan.views) {
    height = std::max(height, axis.dot(view.spindle_mm));
  }
  for (std::size_t i = 0; i < plan.views.size(); ++i) {
    const Vector3d& place_mm = plan.views[i].spindle_mm;
    const Vector3d above_mm = place_mm + (height - axis.dot(place_mm)) * axis;
    if (!WithinTravel(options, above_mm)) {
      plan.reason = fmt::format(
          "to pass part and fixture by {:.0f} mm the spindle must go to X {:.1f} Y {:.1f} Z "
          "{:.1f}, "
          "which lies outside the travel: give a shorter working distance, less clearance or a "
          "lower fixture",
          options.clearance_mm, above_mm.x(), above_mm.y(), above_mm.z());
      plan.way_mm.clear();
      plan.view_at.clear();
      return false;
    }
    plan.way_mm.insert(plan.way_mm.end(), {above_mm, place_mm, above_mm});
    plan.view_at.insert(plan.view_at.end(), {-1, static_cast<int>(i), -1});
  }
  return true;
}

}  // namespace

double ToolLength(const Camera& camera, double stated_mm) {
  constexpr double kLens_mm = 30;
  return stated_mm > 0 ? stated_mm
                       : std::abs(camera.taper_from_camera.translation_mm.z()) + kLens_mm;
}

bool WithinTravel(const ViewPlanOptions& options, const Vector3d& spindle_mm) {
  return ((spindle_mm - options.travel.low_mm).array() >= 0).all() &&
         ((options.travel.high_mm - spindle_mm).array() >= 0).all();
}

bool ClearOfObstacles(const ViewPlanOptions& options, double tool_length_mm,
                      const Vector3d& spindle_mm, const Eigen::Matrix3d& spindle_rotation) {
  return std::all_of(
      options.obstacles.begin(), options.obstacles.end(), [&](const MachineBox& obstacle) {
        Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
        Vector3d high = -low;
        for (int i = 0; i < 8; ++i) {
          const Vector3d corner = spindle_rotation.transpose() * (Corner(obstacle, i) - spindle_mm);
          low = low.cwiseMin(corner);
          high = high.cwiseMax(corner);
        }
        const double beside_mm =
            std::hypot(std::max({low.x(), -high.x(), 0.0}), std::max({low.y(), -high.y(), 0.0}));
        return high.z() <= -tool_length_mm - options.clearance_mm ||
               beside_mm >= options.tool_radius_mm + options.clearance_mm;
      });
}

Result<ViewPlan> PlanViews(const Camera& camera, const std::vector<PartTarget>& targets,
                           const geometry::Pose& rough_machine_from_part,
                           const ViewPlanOptions& options) {
  TRY(Check(camera, targets, rough_machine_from_part, options));
  Choosing choosing = Prepare(camera, targets, rough_machine_from_part, options);
  ViewPlan plan;
  if (choosing.candidates.empty()) {
    plan.reason = fmt::format(
        "none of {} possible views lies within the travel and clear of the "
        "obstacles: check the part's rough place and the working distance",
        choosing.before_room);
    return plan;
  }
  plan.reason = Choose(targets, options, choosing, plan);
  if (plan.views.empty()) {
    return plan;
  }
  plan.observability = Observe(choosing.problem, choosing.theta, options.weakest_goal_mm);
  Order(plan);
  if (!plan.reason.empty() || !FillWay(options, ToolLength(camera, options.tool_length_mm), plan)) {
    return plan;
  }
  if (!plan.observability.words.empty()) {
    plan.reason = fmt::format("{} views do not reach the goal: {}", plan.views.size(),
                              plan.observability.words);
    return plan;
  }
  plan.verdict = Verdict::kGood;
  return plan;
}

}  // namespace trammel::part_alignment
