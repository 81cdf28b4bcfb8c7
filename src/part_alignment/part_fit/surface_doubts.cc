#include "part_alignment/part_fit/surface_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace trammel::part_alignment {
namespace {

struct OnSurface {
  double squares_mm2 = 0;  // of stock allowance less wanted
  double sum_mm = 0;       // of stock allowances
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
  if (options.most_uneven_mm) return *options.most_uneven_mm;
  constexpr double kOfExtent = 1.0 / 50;
  constexpr double kOfRadius = 1.0 / 3;
  const double of_size_mm =
      surface.kind == SurfaceKind::kPlane ? kOfExtent * extent_mm : kOfRadius * surface.radius_mm;
  return std::max(std::abs(surface.stock_allowance_mm), of_size_mm);
}

}  // namespace

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
