#include "part_alignment/part_fit/fit_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {
namespace {

// Describes placements that fit as well as the selected one; empty if there are none.
std::string Alike(const Problem& problem, const Motion& motion,
                  const std::vector<FoundPlacement>& others) {
  double square = 0;
  for (const SurfaceContact& contact : problem.contacts) {
    square += contact.sigma_mm * contact.sigma_mm / static_cast<double>(problem.contacts.size());
  }
  const double own_mm = Scatter_mm(problem, Linearise(problem, motion));
  constexpr double kAlike = 1.5;
  const double max_mm = kAlike * own_mm + std::sqrt(square);
  for (const FoundPlacement& other : others) {
    constexpr double kCoarse = 1.5;  // other fits use few points
    if (other.scatter_mm > kCoarse * max_mm) continue;
    constexpr int kRounds = 15;
    const Motion there = FitSurfaces(problem, other.motion, kRounds);
    const double there_mm = Scatter_mm(problem, Linearise(problem, there));
    if (there_mm > max_mm || SamePlacement(problem, motion, there)) continue;
    return fmt::format(
        "two placements fit alike: {} the stock allowances are uneven by {:.3f} mm instead of "
        "{:.3f} mm; say roughly which one it is (start)",
        TurnText(motion, there), there_mm, own_mm);
  }
  return {};
}

// Explains why points do not belong to this mesh; empty if they may.
std::string NotOnMesh(const Problem& problem, const PartFitOptions& options, const Motion& motion) {
  const double uneven_mm = Scatter_mm(problem, Linearise(problem, motion));
  double max_mm = 0;
  std::set<const MeshDistance*> seen;
  for (const SurfaceContact& contact : problem.contacts) {
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    max_mm = std::max(max_mm, std::abs(contact.surface->stock_allowance_mm));
    if (!seen.insert(contact.surface->mesh.get()).second) continue;
    constexpr double kOfDiameter = 1.0 / 50;
    max_mm = std::max(max_mm, kOfDiameter * DiameterOf(*contact.surface->mesh));
  }
  if (options.max_uneven_mm) max_mm = *options.max_uneven_mm;
  if (uneven_mm <= max_mm) return {};
  return fmt::format(
      "the points do not lie on the mesh: their stock allowances are uneven by {:.3f} mm (root "
      "mean square about their mean) wherever the part is placed, {:.3f} mm are accepted; another "
      "part, another "
      "unit, or most_uneven_mm for a raw part that is so uneven",
      uneven_mm, max_mm);
}

struct OnSurface {
  double squares_mm2 = 0;  // stock allowance less target, squared
  double sum_mm = 0;       // sum of stock allowances
  int count = 0;

  [[nodiscard]] double off_mm() const { return std::sqrt(squares_mm2 / count); }
};

double ExtentOf(const Problem& problem) {
  Eigen::Vector3d least = problem.contacts.front().at_mm;
  Eigen::Vector3d most = least;
  for (const SurfaceContact& contact : problem.contacts) {
    least = least.cwiseMin(contact.at_mm);
    most = most.cwiseMax(contact.at_mm);
  }
  return (most - least).norm();
}

// A radius that is a diameter is off by half of itself, a length in inches by nearly all of it.
double Accepted_mm(const PartFitOptions& options, const IdealSurface& surface, double extent_mm) {
  if (options.max_uneven_mm) return *options.max_uneven_mm;
  constexpr double kOfExtent = 1.0 / 50;
  constexpr double kOfRadius = 1.0 / 3;
  const double of_size_mm =
      surface.kind == SurfaceKind::kPlane ? kOfExtent * extent_mm : kOfRadius * surface.radius_mm;
  return std::max(std::abs(surface.stock_allowance_mm), of_size_mm);
}

// Computes least squares robust to a few wrong points: their weights fall with each round.
Linear RobustLinear(Problem problem, Motion motion) {
  constexpr int kRounds = 10;
  const Eigen::VectorXd weights = Weights(problem);
  const Eigen::VectorXd wanted = Wanted(problem);
  Linear linear = Linearise(problem, motion);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> off;
    for (const double mm : Eigen::VectorXd(linear.stock_allowance_mm - wanted)) {
      off.push_back(std::abs(mm));
    }
    constexpr double kMin_mm = 1e-6;
    const double usual_mm = 3 * std::max(Median(off), kMin_mm);
    for (std::size_t i = 0; i < off.size(); ++i) {
      problem.contacts[i].weight =
          weights[static_cast<Eigen::Index>(i)] / (1 + std::pow(off[i] / usual_mm, 2));
    }
    motion = FitSurfaces(problem, motion);
    linear = Linearise(problem, motion);
  }
  return linear;
}

}  // namespace

MeshDoubt DoubtOf(const PartFitInput& input, const PartFitOptions& options, const Problem& problem,
                  const Motion& motion, const std::vector<FoundPlacement>& others) {
  if (std::string reason = NotOnMesh(problem, options, motion); !reason.empty()) {
    return {Verdict::kRefused, std::move(reason)};
  }
  if (std::string reason = Alike(problem, motion, others); !reason.empty()) {
    return {Verdict::kCannotTell, std::move(reason)};
  }
  return {Verdict::kCannotTell, BeyondRim(input, problem, Linearise(problem, motion))};
}

FacetGuard GuardFacets(Problem& problem, const Linear& linear) {
  FacetGuard guard;
  double min_sigma_mm = std::numeric_limits<double>::infinity();
  bool surfaces_known = true;  // under every point
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    SurfaceContact& contact = problem.contacts[i];
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    const FacetError error = FacetErrorOf(*contact.surface->mesh, linear.triangles[i]);
    const double error_mm = error.left_mm.value_or(error.either_mm());
    min_sigma_mm = std::min(min_sigma_mm, contact.sigma_mm);
    surfaces_known = surfaces_known && error.left_mm.has_value();
    contact.min_mm += error.left_mm.value_or(kFacetGuard * error.outward_mm);
    contact.sigma_mm = std::hypot(contact.sigma_mm, error_mm);
    guard.error_mm = std::max(guard.error_mm, error_mm);
    const auto max_mm = contact.surface->max_facet_error_mm;
    if (!max_mm || !(error_mm > *max_mm) || !guard.coarse.empty()) continue;
    guard.coarse = fmt::format(
        "the mesh of {} is too coarse: under the points its triangles are up to {:.4f} mm off the "
        "surface that they stand for, most_facet_error_mm is {:.4f}; export it with a finer "
        "deflection",
        contact.surface->id, error_mm, *max_mm);
  }
  constexpr double kShown_mm = 5e-5;
  if (!(guard.error_mm > kShown_mm)) return guard;
  if (surfaces_known) {
    guard.notice = fmt::format(
        "stock allowance is from the part's own surfaces to within {:.4f} mm, which is in the "
        "guard and in the covariance",
        guard.error_mm);
    return guard;
  }
  guard.notice = fmt::format(
      "the triangles under the points are up to {:.4f} mm off the smooth surface that they stand "
      "for, which is in the guard and in the covariance{}",
      guard.error_mm,
      guard.error_mm > min_sigma_mm
          ? "; that is more than a point's sigma, and a finer deflection makes it less"
          : "");
  return guard;
}

std::string BeyondRim(const PartFitInput& input, const Problem& problem, const Linear& linear) {
  std::size_t count = 0;
  std::string first;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    if (linear.at_rim[i] == 0) continue;
    if (++count == 1) first = input.points[problem.contacts[i].point].id;
  }
  if (count == 0) return {};
  return fmt::format(
      "{} points lie beyond the rim of the open shell (the first is {}), where no stock allowance "
      "is known: leave them out, or export more of the surface",
      count, first);
}

std::string TurnedRound(const Problem& problem, const Motion& motion) {
  constexpr double kBeside = 0.01;  // share of the extent: neither behind nor in front of the plane
  constexpr double kMax = 0.5;      // share of points in front, minimum
  const double beside_mm = kBeside * ExtentOf(problem);
  std::map<const IdealSurface*, std::pair<int, int>> sides;  // points behind and before
  for (const SurfaceContact& of : problem.contacts) sides[of.surface];
  for (auto& [surface, side] : sides) {
    if (surface->kind != SurfaceKind::kPlane) continue;
    int others = 0;
    for (const SurfaceContact& contact : problem.contacts) {
      if (contact.surface == surface) continue;
      const double out_mm = surface->direction.dot(motion(contact.at_mm) - surface->middle_mm);
      ++others;
      side.first += out_mm < -beside_mm ? 1 : 0;
      side.second += out_mm > beside_mm ? 1 : 0;
    }
    if (side.first > 0 || side.second < kMax * others || others == 0) continue;
    return fmt::format(
        "the direction of {} seems turned round: it must show out of the part, and all {} points "
        "of other surfaces lie on that side; turn it, or measure a surface behind it",
        surface->id, others);
  }
  return {};
}

std::string WildPoint(const PartFitInput& input, const Problem& problem, const Motion& motion) {
  constexpr std::size_t kMin = 4;   // points per surface: three have no outlier
  constexpr double kScatters = 10;  // robust scatters of the other points
  constexpr double kSigmas = 10;    // sigmas of the point
  constexpr double kDents = 2;      // times the stock allowance
  // One of a mesh's many points has little influence, and the robust rounds are slow.
  const Linear linear =
      problem.has_mesh ? Linearise(problem, motion) : RobustLinear(problem, motion);
  std::map<const IdealSurface*, std::vector<std::size_t>> surfaces;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    surfaces[problem.contacts[i].surface].push_back(i);
  }
  double worst = 1;
  std::string words;
  for (const auto& [surface, contacts] : surfaces) {
    if (contacts.size() < kMin) continue;
    std::vector<double> allowances;
    for (const std::size_t i : contacts) {
      allowances.push_back(linear.stock_allowance_mm[static_cast<Eigen::Index>(i)]);
    }
    const double middle_mm = Median(allowances);
    const double scatter_mm = RobustStandardDeviation(allowances);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const SurfaceContact& contact = problem.contacts[contacts[k]];
      const double max_mm = std::max({kScatters * scatter_mm, kSigmas * contact.sigma_mm,
                                      kDents * std::abs(surface->stock_allowance_mm)});
      const double off_mm = std::abs(allowances[k] - middle_mm);
      if (!(off_mm > worst * max_mm)) continue;
      worst = off_mm / max_mm;
      words = fmt::format(
          "point {} is {:.3f} mm {} the other points of {}, which scatter by {:.3f} mm: measure it "
          "anew, name its own surface, or leave it out of the table",
          input.points[contact.point].id, off_mm, allowances[k] > middle_mm ? "outside" : "inside",
          surface->id, scatter_mm);
    }
  }
  return words;
}

std::string NotOnSurfaces(const PartFitOptions& options, const Problem& problem,
                          const Linear& linear) {
  std::map<const IdealSurface*, OnSurface> surfaces;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const IdealSurface* surface = problem.contacts[i].surface;
    if (surface->kind == SurfaceKind::kMesh) continue;
    const double allowance_mm = linear.stock_allowance_mm[static_cast<Eigen::Index>(i)];
    const double off_mm = allowance_mm - surface->stock_allowance_mm;
    OnSurface& on = surfaces[surface];
    on.squares_mm2 += off_mm * off_mm;
    on.sum_mm += allowance_mm;
    ++on.count;
  }
  if (surfaces.empty()) return {};
  const double extent_mm = ExtentOf(problem);
  const auto times = [&](const auto& at) {
    return at.second.off_mm() / Accepted_mm(options, *at.first, extent_mm);
  };
  const auto worst =
      std::max_element(surfaces.begin(), surfaces.end(),
                       [&](const auto& a, const auto& b) { return times(a) < times(b); });
  if (times(*worst) <= 1) return {};
  const IdealSurface& surface = *worst->first;
  return fmt::format(
      "the points of {} do not lie on it: their stock allowance is {:.3f} mm on the average where "
      "{:.3f} mm are wanted ({:.3f} mm off, root mean square; {:.3f} mm are accepted): its {}, the "
      "unit, or the points' surface is wrong; most_uneven_mm is for a raw part that is so uneven",
      surface.id, worst->second.sum_mm / worst->second.count, surface.stock_allowance_mm,
      worst->second.off_mm(), Accepted_mm(options, surface, extent_mm),
      surface.kind == SurfaceKind::kPlane ? "middle_mm or direction" : "radius_mm or middle_mm");
}

}  // namespace trammel::part_alignment
