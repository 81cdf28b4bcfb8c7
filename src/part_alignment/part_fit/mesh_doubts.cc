#include "part_alignment/part_fit/mesh_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/part_fit/surface_descent.h"

namespace trammel::part_alignment {
namespace {

// Placements that fit as well as the one that was taken, in words; empty where there are none.
std::string Alike(const Problem& problem, const Motion& motion,
                  const std::vector<FoundPlacement>& others) {
  double square = 0;
  for (const SurfaceContact& contact : problem.contacts) {
    square += contact.sigma_mm * contact.sigma_mm / static_cast<double>(problem.contacts.size());
  }
  const double own_mm = Scatter_mm(problem, Linearise(problem, motion));
  constexpr double kAlike = 1.5;
  const double most_mm = kAlike * own_mm + std::sqrt(square);
  for (const FoundPlacement& other : others) {
    constexpr double kCoarse = 1.5;  // as few points see it
    if (other.scatter_mm > kCoarse * most_mm) continue;
    constexpr int kRounds = 15;
    const Motion there = FitSurfaces(problem, other.motion, kRounds);
    const double there_mm = Scatter_mm(problem, Linearise(problem, there));
    if (there_mm > most_mm || SamePlacement(problem, motion, there)) continue;
    return fmt::format(
        "two placements fit alike: {} the stock allowances are uneven by {:.3f} mm instead of "
        "{:.3f} mm; say roughly which one it is (start)",
        TurnWords(motion, there), there_mm, own_mm);
  }
  return {};
}

// Why points are not this mesh's; empty where they may be.
std::string NotOnMesh(const Problem& problem, const PartFitOptions& options, const Motion& motion) {
  const double uneven_mm = Scatter_mm(problem, Linearise(problem, motion));
  double most_mm = 0;
  std::set<const MeshDistance*> seen;
  for (const SurfaceContact& contact : problem.contacts) {
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    most_mm = std::max(most_mm, std::abs(contact.surface->stock_allowance_mm));
    if (!seen.insert(contact.surface->mesh.get()).second) continue;
    constexpr double kOfDiameter = 1.0 / 50;
    most_mm = std::max(most_mm, kOfDiameter * DiameterOf(*contact.surface->mesh));
  }
  if (options.most_uneven_mm) most_mm = *options.most_uneven_mm;
  if (uneven_mm <= most_mm) return {};
  return fmt::format(
      "the points do not lie on the mesh: their stock allowances are uneven by {:.3f} mm (root "
      "mean square about their mean) wherever the part is placed, {:.3f} mm are accepted; another "
      "part, another "
      "unit, or most_uneven_mm for a raw part that is so uneven",
      uneven_mm, most_mm);
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
  double least_sigma_mm = std::numeric_limits<double>::infinity();
  bool surfaces_known = true;  // under every point
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    SurfaceContact& contact = problem.contacts[i];
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    const FacetError error = FacetErrorOf(*contact.surface->mesh, linear.triangles[i]);
    const double error_mm = error.left_mm.value_or(error.either_mm());
    least_sigma_mm = std::min(least_sigma_mm, contact.sigma_mm);
    surfaces_known = surfaces_known && error.left_mm.has_value();
    contact.least_mm += error.left_mm.value_or(kFacetGuard * error.outward_mm);
    contact.sigma_mm = std::hypot(contact.sigma_mm, error_mm);
    guard.error_mm = std::max(guard.error_mm, error_mm);
    const auto most_mm = contact.surface->most_facet_error_mm;
    if (!most_mm || !(error_mm > *most_mm) || !guard.coarse.empty()) continue;
    guard.coarse = fmt::format(
        "the mesh of {} is too coarse: under the points its triangles are up to {:.4f} mm off the "
        "surface that they stand for, most_facet_error_mm is {:.4f}; export it with a finer "
        "deflection",
        contact.surface->id, error_mm, *most_mm);
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
      guard.error_mm > least_sigma_mm
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

}  // namespace trammel::part_alignment
