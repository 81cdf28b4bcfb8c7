// Minimises a sum of squares by Levenberg-Marquardt: the one loop of all adjustments in part
// alignment.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trammel::part_alignment {

struct DescentOptions {
  int max_iterations = 60;
  /// Convergence threshold of a step's predicted reduction of the cost, as a share of (1 + cost).
  /// The cost is in squared sigmas, so the rest is negligible.
  double enough = 1e-9;
};

struct DescentEnd {
  bool converged = false;
  int iterations = 0;
  double cost = std::numeric_limits<double>::infinity();
};

/// Cauchy's loss of a squared residual: the pull of an outlier falls with its distance.
struct CauchyLoss {
  double width2 = 0;  ///< squared, in squared sigmas; 0: plain squares
  [[nodiscard]] double Cost(double s) const {
    return width2 > 0 ? width2 * std::log1p(s / width2) : s;
  }
  /// The derivative of Cost.
  [[nodiscard]] double Weight(double s) const { return width2 > 0 ? 1 / (1 + s / width2) : 1; }
};

/// Step that a model proposes.
template <class State>
struct Proposal {
  State state;
  double decrement = 0;  ///< of the cost, predicted by the linear model
};

/// Descends from `state`, which returns the lowest cost found. A step that raises the cost is
/// repeated with ten times the damping. An infinite cost marks a state that the model cannot have;
/// if the first cost is infinite, nothing is done.
///
/// @param model  double Cost(state); auto Linearise(state);
///               Proposal<State> Propose(linearised, damping, state).
template <class Model, class State>
DescentEnd Minimise(const Model& model, const DescentOptions& options, State& state) {
  constexpr double kFirstDamping = 1e-4;
  constexpr double kMinDamping = 1e-15;
  constexpr double kMaxDamping = 1e10;
  DescentEnd end;
  end.cost = model.Cost(state);
  double damping = kFirstDamping;
  while (std::isfinite(end.cost) && !end.converged && end.iterations < options.max_iterations) {
    ++end.iterations;
    const auto linearised = model.Linearise(state);
    bool accepted = false;
    while (!accepted) {
      if (damping > kMaxDamping) return end;
      Proposal<State> next = model.Propose(linearised, damping, state);
      const double cost = model.Cost(next.state);
      const bool still = next.decrement < options.enough * (1 + end.cost);
      // A step below the end's threshold is accepted even if rounding raises the cost.
      accepted = cost <= end.cost || (still && std::isfinite(cost));
      if (accepted) {
        state = std::move(next.state);
        end.cost = cost;
        end.converged = still;
        damping = std::max(0.1 * damping, kMinDamping);
      } else {
        damping = std::max(damping, 1e-9) * 10;
      }
    }
  }
  return end;
}

}  // namespace trammel::part_alignment
