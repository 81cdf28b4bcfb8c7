#include "part_alignment/part_fit/surface_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "part_alignment/part_fit/surface_descent.h"

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

// Least squares that a few wrong points do not pull: they weigh less with each round.
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
    constexpr double kLeast_mm = 1e-6;
    const double usual_mm = 3 * std::max(Median(off), kLeast_mm);
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

std::string TurnedRound(const Problem& problem, const Motion& motion) {
  constexpr double kBeside = 0.01;  // of the extent: neither behind the plane nor before it
  constexpr double kMost = 0.5;     // of the points before it, at least
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
    if (side.first > 0 || side.second < kMost * others || others == 0) continue;
    return fmt::format(
        "the direction of {} seems turned round: it must show out of the part, and all {} points "
        "of other surfaces lie on that side; turn it, or measure a surface behind it",
        surface->id, others);
  }
  return {};
}

std::string WildPoint(const PartFitInput& input, const Problem& problem, const Motion& motion) {
  constexpr std::size_t kLeast = 4;  // of a surface: of three none stands out
  constexpr double kScatters = 10;   // of what the others scatter by, robustly
  constexpr double kSigmas = 10;     // of the point
  constexpr double kDents = 2;       // times the stock allowance
  // Of a mesh's many points one pulls little, and the rounds cost much.
  const Linear linear =
      problem.has_mesh ? Linearise(problem, motion) : RobustLinear(problem, motion);
  std::map<const IdealSurface*, std::vector<std::size_t>> surfaces;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    surfaces[problem.contacts[i].surface].push_back(i);
  }
  double worst = 1;
  std::string words;
  for (const auto& [surface, contacts] : surfaces) {
    if (contacts.size() < kLeast) continue;
    std::vector<double> allowances;
    for (const std::size_t i : contacts) {
      allowances.push_back(linear.stock_allowance_mm[static_cast<Eigen::Index>(i)]);
    }
    const double middle_mm = Median(allowances);
    const double scatter_mm = RobustStandardDeviation(allowances);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const SurfaceContact& contact = problem.contacts[contacts[k]];
      const double most_mm = std::max({kScatters * scatter_mm, kSigmas * contact.sigma_mm,
                                       kDents * std::abs(surface->stock_allowance_mm)});
      const double off_mm = std::abs(allowances[k] - middle_mm);
      if (!(off_mm > worst * most_mm)) continue;
      worst = off_mm / most_mm;
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
