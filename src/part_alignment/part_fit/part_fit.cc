#include "part_alignment/part_fit/part_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "geometry/linear_systems.h"
#include "part_alignment/part_fit/fit_doubts.h"
#include "part_alignment/part_fit/fit_start.h"
#include "part_alignment/part_fit/part_fit_problem.h"
#include "part_alignment/part_fit/scale_bars.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kMax_mm = 1e6;

bool Sound(const Eigen::Vector3d& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMax_mm; }

Result<void> CheckMesh(const IdealSurface& surface) {
  if (surface.mesh == nullptr) return Fail(fmt::format("surface {} has no mesh", surface.id));
  if (!(std::abs(surface.stock_allowance_mm) < kMax_mm)) {
    return Fail(
        fmt::format("surface {}: overstock_mm is {}", surface.id, surface.stock_allowance_mm));
  }
  if (surface.max_facet_error_mm && !(*surface.max_facet_error_mm > 0)) {
    return Fail(fmt::format("surface {}: most_facet_error_mm is {}; it must be above 0", surface.id,
                            *surface.max_facet_error_mm));
  }
  return {};
}

// Checks that a surface's wanted allowance is at least the minimum for every point, else it would
// never be reached.
Result<void> CheckWanted(const IdealSurface& surface, const PartFitOptions& options) {
  if (!(surface.stock_allowance_mm < std::min(0.0, options.min_stock_allowance_mm))) return {};
  return Fail(fmt::format(
      "surface {}: overstock_mm is {}, and every point must have {} mm: material outside of the "
      "ideal surface counts as positive",
      surface.id, surface.stock_allowance_mm, options.min_stock_allowance_mm));
}

Result<std::set<std::string>> CheckSurfaces(PartFitInput& input, const PartFitOptions& options) {
  std::set<std::string> ids;
  for (IdealSurface& surface : input.surfaces) {
    if (!ids.insert(surface.id).second) {
      return Fail(fmt::format("surface {} stands there twice", surface.id));
    }
    TRY(CheckWanted(surface, options));
    if (surface.kind == SurfaceKind::kMesh) {
      TRY(CheckMesh(surface));
      continue;
    }
    const double length = surface.direction.norm();
    if (!Sound(surface.middle_mm) || !(length > 1e-9 && length < kMax_mm)) {
      return Fail(fmt::format("surface {}: its middle or its direction cannot be", surface.id));
    }
    surface.direction /= length;
    if (surface.kind != SurfaceKind::kPlane &&
        !(surface.radius_mm > 0 && surface.radius_mm < kMax_mm)) {
      return Fail(fmt::format("surface {}: radius_mm is {}; it must be above 0", surface.id,
                              surface.radius_mm));
    }
    if (!(std::abs(surface.stock_allowance_mm) < kMax_mm)) {
      return Fail(
          fmt::format("surface {}: overstock_mm is {}", surface.id, surface.stock_allowance_mm));
    }
  }
  return ids;
}

Result<std::set<std::string>> CheckPoints(const PartFitInput& input,
                                          const std::set<std::string>& surfaces) {
  std::set<std::string> ids;
  std::set<std::string> touched;
  std::size_t targets = 0;
  for (const MeasuredPoint& point : input.points) {
    if (!ids.insert(point.id).second) {
      return Fail(fmt::format("point {} stands there twice", point.id));
    }
    if (!Sound(point.at_mm) || !(point.sigma_mm > 0 && point.sigma_mm < kMax_mm)) {
      return Fail(
          fmt::format("point {}: {} {} {} mm, sigma {} mm; numbers must be finite, sigma "
                      "above 0",
                      point.id, point.at_mm.x(), point.at_mm.y(), point.at_mm.z(), point.sigma_mm));
    }
    if (point.surface.empty()) {
      ++targets;
      continue;
    }
    if (!surfaces.contains(point.surface)) {
      return Fail(fmt::format("point {}: the surface {} is none of the ideal part's ({})", point.id,
                              point.surface, fmt::join(surfaces, ", ")));
    }
    touched.insert(point.surface);
  }
  constexpr std::size_t kMaxTargets = 1000;  // their covariance has nine numbers for each pair
  if (targets > kMaxTargets) {
    return Fail(
        fmt::format("{} points without a surface; at most {} can be targets: name the "
                    "surface of measured points",
                    targets, kMaxTargets));
  }
  for (const std::string& surface : surfaces) {
    if (!touched.contains(surface)) {
      return Fail(fmt::format(
          "surface {} has no measured point: measure it, or leave it out of the file", surface));
    }
  }
  return ids;
}

/// Returns the input with directions of length 1. Errors (kInput) as in FitPart.
Result<PartFitInput> CheckedPartFit(const PartFitInput& input, const PartFitOptions& options) {
  PartFitInput checked = input;
  if (options.max_uneven_mm && !(*options.max_uneven_mm > 0)) {
    return Fail(fmt::format("most_uneven_mm is {}; it must be above 0", *options.max_uneven_mm));
  }
  if (!std::isfinite(options.min_stock_allowance_mm) ||
      !(options.guard_sigmas >= 0 && options.guard_sigmas <= 10) ||
      !(options.max_scale_change >= 0 && options.max_scale_change <= 0.1)) {
    return Fail(fmt::format(
        "least stock allowance {} mm, guard {} sigmas (0 … 10), scale change {} "
        "(0 … 0.1)",
        options.min_stock_allowance_mm, options.guard_sigmas, options.max_scale_change));
  }
  constexpr double kThickest_mm = 10;
  if (!(options.target_thickness_mm >= 0 && options.target_thickness_mm <= kThickest_mm) ||
      !(options.target_thickness_sigma_mm >= 0 &&
        options.target_thickness_sigma_mm <= kThickest_mm)) {
    return Fail(
        fmt::format("targets {} mm thick, sigma {} mm; 0 … {} are possible, in mm (100 µm are 0.1)",
                    options.target_thickness_mm, options.target_thickness_sigma_mm, kThickest_mm));
  }
  const auto surfaces = TRY(CheckSurfaces(checked, options));
  const auto points = TRY(CheckPoints(checked, surfaces));
  std::set<std::pair<std::string, std::string>> bar_ends;
  for (const ScaleBar& bar : checked.bars) {
    if (!bar_ends.insert(std::minmax(bar.from, bar.to)).second) {
      return Fail(fmt::format(
          "scale bar {}-{} stands there twice: it would count as two; of a bar that was calibrated "
          "several times give the mean",
          bar.from, bar.to));
    }
    for (const std::string& end : {bar.from, bar.to}) {
      if (!points.contains(end)) {
        return Fail(
            fmt::format("scale bar {}-{}: {} is none of the points", bar.from, bar.to, end));
      }
    }
    if (bar.from == bar.to || !(bar.length_mm > 0 && bar.length_mm < kMax_mm) ||
        !(bar.sigma_mm >= 0 && bar.sigma_mm < kMax_mm)) {
      return Fail(fmt::format("scale bar {}-{}: {} mm, sigma {} mm; its length must be above 0",
                              bar.from, bar.to, bar.length_mm, bar.sigma_mm));
    }
  }
  return checked;
}

/// Computes the factor from measured to calibrated lengths, and tests the bars against one another;
/// without bars 1, unchecked. A factor farther from 1 than most_scale_change is a fault, too.
/// REQUIRES a checked input.
BarScale ScaleOf(const PartFitInput& input, const PartFitOptions& options) {
  if (input.bars.empty()) {
    BarScale as_it_is;
    as_it_is.unchecked =
        "the scale is that of the measurement, without a scale bar: its error is not in the "
        "covariance; add two bars";
    return as_it_is;
  }
  const auto count = std::ssize(input.bars);
  FoundBars found{input.bars, Eigen::VectorXd(count), {}};
  std::map<std::string, Eigen::Index> columns;  // three for each end
  Eigen::MatrixXd by_sigma = Eigen::MatrixXd::Zero(count, 6 * count);
  const auto end_of = [&](const std::string& id) {
    return *std::find_if(input.points.begin(), input.points.end(),
                         [&id](const MeasuredPoint& point) { return point.id == id; });
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const ScaleBar& bar = input.bars[static_cast<std::size_t>(i)];
    const MeasuredPoint from = end_of(bar.from);
    const MeasuredPoint to = end_of(bar.to);
    const Eigen::Vector3d along = to.at_mm - from.at_mm;
    found.lengths[i] = along.norm();
    if (!(found.lengths[i] > 0)) {
      BarScale none;
      none.fault = fmt::format("the scale bar {}-{} has both of its ends at one place: check them",
                               bar.from, bar.to);
      return none;
    }
    const Eigen::RowVector3d share = (along / along.squaredNorm()).transpose();
    for (const auto& [end, signed_share] :
         {std::pair(&to, share), std::pair(&from, Eigen::RowVector3d(-share))}) {
      const auto column = columns.emplace(end->id, 3 * std::ssize(columns)).first->second;
      by_sigma.block<1, 3>(i, column) += end->sigma_mm * signed_share;
    }
  }
  found.covariance = by_sigma * by_sigma.transpose();
  BarScale result = TestBars(found);
  if (result.fault.empty() && !(std::abs(result.scale - 1) <= options.max_scale_change)) {
    result.fault = fmt::format(
        "the scale bars ask for a scale of {:.6f}, at most {:g} from 1 is accepted: a bar's "
        "length, its ends or the unit of the table are wrong",
        result.scale, options.max_scale_change);
  }
  return result;
}

// Step towards even stock allowance that retains `least` everywhere; absent if there is none.
struct Step {
  Vector6 motion = Vector6::Zero();
  std::vector<Index> binding;
};

std::optional<Step> EvenStep(const Problem& problem, const Linear& linear, const VectorXd& least) {
  const VectorXd weights = Weights(problem);
  const MatrixXd weighted = weights.asDiagonal() * linear.by_motion;
  const Matrix6 normal = linear.by_motion.transpose() * weighted;
  const MatrixXd root = geometry::CholeskyRoot(normal);
  const Vector6 gradient = weighted.transpose() * (linear.stock_allowance_mm - Wanted(problem));
  const Vector6 q = geometry::SolveLower(root, gradient);
  // With z = Lᵀ y + q, the sum of squares is |z|² plus a constant.
  const MatrixXd rows = geometry::SolveLower(root, linear.by_motion.transpose()).transpose();
  const VectorXd right = least - linear.stock_allowance_mm + rows * q;
  const auto nearest = SolveLeastDistance(rows, right);
  if (!nearest) return std::nullopt;
  const Vector6 z = nearest->point;
  return Step{geometry::SolveUpper(root.transpose(), z - q), nearest->binding};
}

constexpr int kMaxRounds = 60;
constexpr double kStill_mm = 1e-9;

// Finds the placement whose worst point has the most stock allowance, by bisection on that amount.
Motion BestEffort(const Problem& problem, Motion motion, double& missing_mm) {
  for (int round = 0; round < 10; ++round) {
    const Linear linear = Linearise(problem, motion);
    const VectorXd least = Least(problem);
    double unreachable = 0;
    double reachable = (linear.stock_allowance_mm - least).minCoeff() - 1e-6;
    std::optional<Step> step;
    for (int cut = 0; cut < 40; ++cut) {
      const double shift = (unreachable + reachable) / 2;
      const auto found = EvenStep(problem, linear, least.array() + shift);
      (found ? reachable : unreachable) = shift;
      if (found) step = found;
    }
    missing_mm = -reachable;
    if (!step) break;
    motion = Moved(motion, linear, step->motion, problem.size_mm);
    if (step->motion.norm() < 1e-6) break;
  }
  return motion;
}

void NoteStockAllowances(const PartFitInput& input, const Problem& problem, const Motion& motion,
                         const std::vector<Index>& binding, PartFit& fit) {
  const Linear linear = Linearise(problem, motion);
  fit.ideal_from_measured = {motion.translation_mm, geometry::AnglesFromRotation(motion.rotation)};
  fit.stock_allowances.clear();
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const SurfaceContact& contact = problem.contacts[i];
    fit.stock_allowances.push_back({contact.point, linear.stock_allowance_mm[static_cast<Index>(i)],
                                    contact.surface->stock_allowance_mm, contact.min_mm, false,
                                    linear.by_motion.row(static_cast<Index>(i)).head<3>()});
  }
  for (const Index i : binding) fit.stock_allowances[static_cast<std::size_t>(i)].binding = true;
  fit.min_mm = linear.stock_allowance_mm.minCoeff();
  fit.mean_mm = linear.stock_allowance_mm.mean();
  fit.uneven_mm = Uneven_mm(problem, linear);
  for (const MeasuredPoint& point : input.points) {
    if (!point.surface.empty()) continue;
    fit.targets.push_back({point.id, motion(fit.scale * point.at_mm)});
  }
}

// Computes the placement's response to errors of the points along their normals: differentiates its
// optimality conditions (Karush, Kuhn and Tucker) with the same points binding.
Matrix6 PlacementCovariance(const Problem& problem, const Linear& linear,
                            const std::vector<Index>& binding) {
  const auto n = std::ssize(problem.contacts);
  const auto active = std::ssize(binding);
  const MatrixXd weighted = Weights(problem).asDiagonal() * linear.by_motion;
  MatrixXd system = MatrixXd::Zero(6 + active, 6 + active);
  MatrixXd right = MatrixXd::Zero(6 + active, n);
  system.topLeftCorner<6, 6>() = linear.by_motion.transpose() * weighted;
  right.topRows<6>() = -weighted.transpose();
  for (Index k = 0; k < active; ++k) {
    const Index i = binding[static_cast<std::size_t>(k)];
    system.block<1, 6>(6 + k, 0) = linear.by_motion.row(i);
    system.block<6, 1>(0, 6 + k) = linear.by_motion.row(i).transpose();
    right(6 + k, i) = -1;
  }
  const MatrixXd by_error = geometry::SolveLeastSquares(system, right).topRows(6);
  VectorXd variance(n);
  for (Index i = 0; i < n; ++i) {
    const double sigma_mm = problem.contacts[static_cast<std::size_t>(i)].sigma_mm;
    variance[i] = sigma_mm * sigma_mm;
  }
  const Vector6 by_thickness = problem.thickness_sigma_mm * by_error.rowwise().sum();
  return by_error * variance.asDiagonal() * by_error.transpose() +
         by_thickness * by_thickness.transpose();
}

void NoteCovariance(const PartFitInput& input, const Problem& problem, const Motion& motion,
                    const std::vector<Index>& binding, PartFit& fit) {
  const Linear linear = Linearise(problem, motion);
  const Matrix6 placement = PlacementCovariance(problem, linear, binding);
  const auto n = 3 * std::ssize(fit.targets);
  MatrixXd by_placement(n, 6);
  VectorXd by_scale(n);
  VectorXd own(n);
  Index row = 0;
  for (const MeasuredPoint& point : input.points) {
    if (!point.surface.empty()) continue;
    const Vector3d from_middle = motion(fit.scale * point.at_mm) - linear.middle_mm;
    by_placement.block<3, 3>(row, 0).setIdentity();
    for (int i = 0; i < 3; ++i) {
      by_placement.block<3, 1>(row, 3 + i) = Vector3d::Unit(i).cross(from_middle) / problem.size_mm;
    }
    // The placement does not move the middle when everything grows about it.
    by_scale.segment<3>(row) = from_middle * fit.scale_sigma;
    own.segment<3>(row).setConstant(point.sigma_mm * point.sigma_mm);
    row += 3;
  }
  fit.covariance = by_placement * placement * by_placement.transpose() +
                   by_scale * by_scale.transpose() + MatrixXd(own.asDiagonal());
}

PartFit Refuse(const PartFitInput& input, const Problem& problem, const Motion& best,
               double missing_mm, PartFit fit) {
  NoteStockAllowances(input, problem, best, {}, fit);
  fit.targets.clear();
  std::string where;
  constexpr double kNearlyWorst_mm = 1e-3;
  constexpr int kMaxNamed = 12;
  int worst = 0;
  for (const PointStockAllowance& at : fit.stock_allowances) {
    if (at.stock_allowance_mm - at.min_mm > -missing_mm + kNearlyWorst_mm) continue;
    if (++worst > kMaxNamed) continue;
    const MeasuredPoint& point = input.points[at.point];
    where += fmt::format("{}{} ({}, {:+.3f} mm)", where.empty() ? "" : ", ", point.id,
                         point.surface, at.stock_allowance_mm);
  }
  if (worst > kMaxNamed) where += fmt::format(" and {} more", worst - kMaxNamed);
  fit.verdict = Verdict::kRefused;
  fit.reason = fmt::format(
      "no placement leaves enough material everywhere: at best {:.3f} mm are missing, at {}",
      missing_mm, where.empty() ? "several points" : where);
  if (kFacetGuard * fit.facet_error_mm >= missing_mm) {
    fit.verdict = Verdict::kCannotTell;
    fit.reason += fmt::format(
        "; as much is kept for the triangles, which are up to {:.3f} mm off the surface that they "
        "stand for: export the mesh with a finer deflection",
        fit.facet_error_mm);
  }
  return fit;
}

PartFit Without(PartFit fit, Verdict verdict, std::string reason) {
  fit.verdict = verdict;
  fit.reason = std::move(reason);
  return fit;
}

// Start of the descent, or the reason why it has none.
struct Begun {
  std::optional<Motion> motion;
  std::vector<FoundPlacement> others;  // second and later placements of a search
  std::string reason;
};

Begun Begin(const PartFitInput& input, const Problem& problem) {
  Begun begun;
  if (input.start) {
    begun.motion =
        Motion{geometry::RotationFromAngles(input.start->angles_rad), input.start->translation_mm};
  } else if (!problem.has_mesh) {
    begun.motion = StartFromMiddles(problem);
    if (!begun.motion) {
      begun.reason =
          "fewer than three surfaces, or their middles in one line: where the ideal part lies "
          "roughly "
          "must be given (start)";
    }
  }
  if (!problem.has_mesh) return begun;
  std::vector<FoundPlacement> found = SearchPlacements(problem);
  if (!begun.motion) {
    begun.motion = found.front().motion;
    begun.others.assign(found.begin() + 1, found.end());
    return begun;
  }
  *begun.motion = FitSurfaces(problem, *begun.motion);
  const double here_mm = Scatter_mm(problem, Linearise(problem, *begun.motion));
  if (2 * found.front().scatter_mm < here_mm &&
      !SamePlacement(problem, *begun.motion, found.front().motion)) {
    begun.reason = fmt::format(
        "from the start that is given the fit ends with stock allowances uneven by {:.3f} mm; "
        "{} they are by {:.3f} mm: correct the start, or leave it out",
        here_mm, TurnText(*begun.motion, found.front().motion), found.front().scatter_mm);
  }
  return begun;
}

// Converged placement, from near it. On triangles, whose normals jump, steps may alternate between
// two facets. They are halved then, and the last tenth of a nanometre is compensated.
struct Rest {
  Motion motion;
  std::vector<Index> binding;
  bool stuck = false;  // no step leaves the least everywhere
};

Rest EvenPlacement(const Problem& problem, Motion motion) {
  Rest rest{motion, {}, false};
  const double still_mm = problem.has_mesh ? 1e-6 : kStill_mm;
  VectorXd least = Least(problem);
  double share = 1;
  double before_mm = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMaxRounds; ++round) {
    const Linear linear = Linearise(problem, rest.motion);
    const auto step = EvenStep(problem, linear, least);
    if (!step) {
      rest.stuck = true;
      return rest;
    }
    const double length_mm = step->motion.norm();
    if (problem.has_mesh && round > 3 && length_mm > before_mm / 2)
      share = std::max(share / 2, 1.0 / 64);
    before_mm = length_mm;
    rest.motion = Moved(rest.motion, linear, share * step->motion, problem.size_mm);
    rest.binding = step->binding;
    if (share * length_mm < still_mm) break;
  }
  if (!problem.has_mesh) return rest;
  constexpr double kHolds_mm = 1e-7;
  constexpr int kMaxMends = 20;
  for (int mend = 0; mend < kMaxMends; ++mend) {
    const Linear linear = Linearise(problem, rest.motion);
    const double missing_mm = (Least(problem) - linear.stock_allowance_mm).maxCoeff();
    if (missing_mm <= kHolds_mm) break;
    least.array() += missing_mm;
    const auto step = EvenStep(problem, linear, least);
    if (!step) break;
    rest.motion = Moved(rest.motion, linear, step->motion, problem.size_mm);
    rest.binding = step->binding;
  }
  return rest;
}

}  // namespace

Result<PartFit> FitPart(const PartFitInput& given, const PartFitOptions& options) {
  const auto checked = TRY(CheckedPartFit(given, options));
  const PartFitInput& input = checked;
  PartFit fit;
  const BarScale bars = ScaleOf(input, options);
  fit.scale = bars.scale;
  fit.scale_sigma = bars.sigma;
  fit.notices = bars.notices;
  if (!bars.unchecked.empty()) fit.unchecked.push_back(bars.unchecked);
  if (options.target_thickness_mm > 0) {
    fit.notices.push_back(fmt::format(
        "{:.3f} mm (k = 1: {:.3f} mm) of target were subtracted from every stock allowance, along "
        "the surface's normal",
        options.target_thickness_mm, options.target_thickness_sigma_mm));
  }
  if (!bars.fault.empty()) {
    fit.reason = bars.fault;
    return fit;
  }
  Problem problem = ProblemOf(input, options, fit.scale);
  RejectionTally tally;  // nothing is left out: what stands out is a doubt
  for (const SurfaceContact& contact : problem.contacts) {
    tally.Add({"surface " + contact.surface->id}, false);
  }
  fit.check = tally.Check(std::max(0, static_cast<int>(problem.contacts.size()) - 6));
  if (problem.has_mesh) {
    if (std::string other = OtherSize(problem); !other.empty()) {
      return Without(std::move(fit), Verdict::kRefused, std::move(other));
    }
  }
  Begun begun = Begin(input, problem);
  if (!begun.reason.empty()) {
    return Without(std::move(fit), Verdict::kCannotTell, std::move(begun.reason));
  }
  const Motion near = FitSurfaces(problem, *begun.motion);
  const Linear linear = Linearise(problem, near);
  const std::string free = FreeMotions(problem, linear, near);
  if (!free.empty()) {
    fit.verdict = Verdict::kCannotTell;
    fit.reason = fmt::format(
        "the measured surfaces leave the part free: {} changes no stock allowance; measure a "
        "surface that stops it",
        free);
    return fit;
  }
  if (std::string turned = TurnedRound(problem, near); !turned.empty()) {
    return Without(std::move(fit), Verdict::kCannotTell, std::move(turned));
  }
  if (problem.has_mesh) {
    if (MeshDoubt doubt = DoubtOf(input, options, problem, near, begun.others);
        !doubt.reason.empty()) {
      return Without(std::move(fit), doubt.verdict, std::move(doubt.reason));
    }
    FacetGuard guard = GuardFacets(problem, linear);
    fit.facet_error_mm = guard.error_mm;
    if (!guard.coarse.empty()) {
      return Without(std::move(fit), Verdict::kCannotTell, std::move(guard.coarse));
    }
    if (!guard.notice.empty()) fit.notices.push_back(std::move(guard.notice));
  }
  if (std::string wild = WildPoint(input, problem, near); !wild.empty()) {
    return Without(std::move(fit), Verdict::kCannotTell, std::move(wild));
  }
  Rest rest = EvenPlacement(problem, near);
  if (rest.stuck) {
    double missing_mm = 0;
    const Motion best = BestEffort(problem, rest.motion, missing_mm);
    if (missing_mm > 0) return Refuse(input, problem, best, missing_mm, std::move(fit));
    rest = EvenPlacement(problem, best);
  }
  const Linear there = Linearise(problem, rest.motion);
  constexpr double kHolds_mm = 1e-6;
  const double missing_mm = (Least(problem) - there.stock_allowance_mm).maxCoeff();
  if (rest.stuck || missing_mm > kHolds_mm) {
    return Without(std::move(fit), Verdict::kCannotTell,
                   fmt::format("the placement does not come to rest: {:.6f} mm are missing at a "
                               "point; give another start",
                               missing_mm));
  }
  if (std::string beyond = BeyondRim(input, problem, there); !beyond.empty()) {
    return Without(std::move(fit), Verdict::kCannotTell, std::move(beyond));
  }
  if (std::string other = NotOnSurfaces(options, problem, there); !other.empty()) {
    return Without(std::move(fit), Verdict::kRefused, std::move(other));
  }
  fit.verdict = Verdict::kGood;
  NoteStockAllowances(input, problem, rest.motion, rest.binding, fit);
  NoteCovariance(input, problem, rest.motion, rest.binding, fit);
  return fit;
}

}  // namespace trammel::part_alignment
