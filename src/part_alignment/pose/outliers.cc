#include "part_alignment/pose/outliers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace trammel::part_alignment {
namespace {

using Indices = std::vector<std::size_t>;

struct Suspicion {
  Indices observations;
  std::string what;
  bool swapped = false;  ///< two observations whose targets are exchanged
};

std::string NameOf(const PoseProblem& problem, const std::vector<std::string>& labels,
                   std::size_t i) {
  return fmt::format("target {} in view {}", labels[problem.observations[i].target],
                     problem.observations[i].view + 1);
}

std::vector<Suspicion> SingleObservations(const PoseProblem& problem,
                                          const std::vector<std::string>& labels) {
  std::vector<Suspicion> suspicions;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    suspicions.push_back({{i}, NameOf(problem, labels, i)});
  }
  return suspicions;
}

/// Returns whole targets and whole views of at least two observations, and exchanged ids.
std::vector<Suspicion> Groups(const PoseProblem& problem, const std::vector<std::string>& labels) {
  std::map<std::size_t, Indices> by_target;
  std::map<std::size_t, Indices> by_view;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    by_target[problem.observations[i].target].push_back(i);
    by_view[problem.observations[i].view].push_back(i);
  }
  std::vector<Suspicion> suspicions;
  for (const auto& [target, observations] : by_target) {
    if (observations.size() > 1) {
      suspicions.push_back({observations, fmt::format("target {}", labels[target])});
    }
  }
  for (const auto& [view, observations] : by_view) {
    for (std::size_t a = 0; a < observations.size(); ++a) {
      for (std::size_t b = a + 1; b < observations.size(); ++b) {
        suspicions.push_back(
            {{observations[a], observations[b]},
             fmt::format("targets {} and {} in view {}, which look exchanged",
                         labels[problem.observations[observations[a]].target],
                         labels[problem.observations[observations[b]].target], view + 1),
             true});
      }
    }
    if (observations.size() > 1) {
      suspicions.push_back({observations, fmt::format("view {}", view + 1)});
    }
  }
  return suspicions;
}

std::vector<Suspicion> Pairs(const PoseProblem& problem, const std::vector<std::string>& labels) {
  std::vector<Suspicion> suspicions;
  for (std::size_t a = 0; a < problem.observations.size(); ++a) {
    for (std::size_t b = a + 1; b < problem.observations.size(); ++b) {
      suspicions.push_back(
          {{a, b},
           fmt::format("{} and {}", NameOf(problem, labels, a), NameOf(problem, labels, b))});
    }
  }
  return suspicions;
}

/// Returns the initial clamp angles: a wrong observation hardly moves the clamp angle by a quarter
/// turn.
std::vector<double> ClampStarts(const PoseProblem& problem, const Fit& all) {
  const Layout layout = LayoutOf(problem.unknowns);
  if (layout.clamp_angle < 0 || !all.found) {
    return {0};
  }
  return {0, all.theta[layout.clamp_angle]};
}

bool Fits(const PoseProblem& problem, const Fit& fit) {
  return fit.found && fit.chi_square <= ChiSquareHigh(DegreesOfFreedom(problem));
}

/// Returns the suspicions of `kind` that make the rest fit, without those that contain another one.
std::vector<Outliers> Explanations(const PoseProblem& problem, const Fit& all,
                                   const std::vector<Suspicion>& kind) {
  std::vector<Outliers> explanations;
  const std::vector<double> starts = ClampStarts(problem, all);
  for (const Suspicion& suspicion : kind) {
    if (suspicion.swapped) {
      PoseProblem exchanged = problem;
      std::swap(exchanged.observations[suspicion.observations[0]].part_mm,
                exchanged.observations[suspicion.observations[1]].part_mm);
      if (!Fits(exchanged, FitFrom(exchanged, starts))) {
        continue;
      }
    }
    const PoseProblem rest = Without(problem, suspicion.observations);
    if (DegreesOfFreedom(rest) < 1) {
      continue;
    }
    const Fit fit = FitFrom(rest, starts);
    if (Fits(rest, fit)) {
      explanations.push_back({suspicion.observations, suspicion.what, fit, {}});
    }
  }
  const auto holds_another = [&](const Outliers& one) {
    return std::any_of(explanations.begin(), explanations.end(), [&](const Outliers& other) {
      return &one != &other && other.observations.size() <= one.observations.size() &&
             (other.observations != one.observations || &other < &one) &&
             std::includes(one.observations.begin(), one.observations.end(),
                           other.observations.begin(), other.observations.end());
    });
  };
  std::vector<Outliers> least;
  std::copy_if(explanations.begin(), explanations.end(), std::back_inserter(least),
               [&](const Outliers& one) { return !holds_another(one); });
  return least;
}

/// Finds outliers of many observations: those that a Cauchy loss repeatedly puts far off.
Outliers ByRobustLoss(const PoseProblem& problem, const Fit& all,
                      const std::vector<std::string>& labels) {
  constexpr double kLoss_sigma = 2;
  constexpr double kFar2 = 25;  // 5 sigma: 4e-6 per observation by chance
  Outliers none;
  none.doubt = "no target, view or pair of observations alone explains it";
  if (!all.found) {
    return none;
  }
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(all.theta.segment<3>(3)));
  const Descent robust = Descend(InMiddleFrame(problem, frame), ToMiddleFrame(frame, all.theta),
                                 {kLoss_sigma * kLoss_sigma});
  const Chain chain(problem, FromMiddleFrame(frame, robust.theta), false);
  Outliers wrong;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    Eigen::Vector2d residual_px;
    const double sigma_px = problem.observations[i].sigma_px;
    if (!chain.Residual(problem.observations[i], residual_px) ||
        residual_px.squaredNorm() > kFar2 * sigma_px * sigma_px) {
      wrong.observations.push_back(i);
      wrong.what += (wrong.what.empty() ? "" : ", ") + NameOf(problem, labels, i);
    }
  }
  const PoseProblem rest = Without(problem, wrong.observations);
  if (wrong.observations.empty() || 4 * wrong.observations.size() > problem.observations.size() ||
      DegreesOfFreedom(rest) < 1) {
    return none;
  }
  wrong.fit = FitFrom(rest, ClampStarts(problem, all));
  return Fits(rest, wrong.fit) ? wrong : none;
}

}  // namespace

Outliers FindOutliers(const PoseProblem& problem, const Fit& all,
                      const std::vector<std::string>& labels) {
  constexpr std::size_t kMaxOneByOne = 60;
  constexpr std::size_t kMaxForPairs = 20;
  const std::size_t count = problem.observations.size();
  if (count <= kMaxOneByOne) {
    std::vector<std::vector<Suspicion>> kinds{SingleObservations(problem, labels),
                                              Groups(problem, labels)};
    if (count <= kMaxForPairs) {
      kinds.push_back(Pairs(problem, labels));
    }
    for (const std::vector<Suspicion>& kind : kinds) {
      const std::vector<Outliers> found = Explanations(problem, all, kind);
      if (found.size() == 1) {
        return found[0];
      }
      if (found.size() > 1) {
        Outliers doubtful;
        doubtful.doubt = fmt::format("either {} or {} is wrong and the views cannot tell which",
                                     found[0].what, found[1].what);
        return doubtful;
      }
    }
  }
  return ByRobustLoss(problem, all, labels);
}

}  // namespace trammel::part_alignment
