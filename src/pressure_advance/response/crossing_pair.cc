#include "pressure_advance/response/crossing_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/square.h"
#include "pressure_advance/response/lag_drift.h"

namespace trammel::pressure_advance {
namespace {

// Covariance of acceleration, deceleration and tail, in this order; s^2.
using Covariance = std::array<std::array<double, 3>, 3>;

// By what each line's excesses, and their difference, stand off others, s; shape (lines) each.
struct Residuals {
  std::vector<double> acceleration, deceleration, early, difference;
};

std::vector<double> Off(const std::vector<double>& seen, const std::vector<double>& other) {
  std::vector<double> off;
  for (std::size_t i = 0; i < seen.size(); ++i) off.push_back(seen[i] - other[i]);
  return off;
}

Residuals OffTheFits(const Transitions& seen, const TransitionCrossings& crossings) {
  Residuals off{.acceleration = Off(seen.acceleration.excess_s, crossings.acceleration.fitted),
                .deceleration = Off(seen.deceleration.excess_s, crossings.deceleration.fitted)};
  if (crossings.early) off.early = Off(seen.early->excess_s, crossings.early->fitted);
  if (crossings.paired) {
    off.difference = Off(Off(seen.acceleration.excess_s, seen.deceleration.excess_s),
                         crossings.paired->fitted_s);
  }
  return off;
}

Residuals OffLaid(const Transitions& seen, const Transitions& laid) {
  Residuals off{.acceleration = Off(seen.acceleration.excess_s, laid.acceleration.excess_s),
                .deceleration = Off(seen.deceleration.excess_s, laid.deceleration.excess_s)};
  if (seen.early) off.early = Off(seen.early->excess_s, laid.early->excess_s);
  off.difference = Off(off.acceleration, off.deceleration);
  return off;
}

// By how far each line's residual moves a value, s.
std::vector<double> MovedBy(const std::vector<double>& off_s,
                            const std::vector<double>& influence) {
  std::vector<double> moved_s;
  for (std::size_t i = 0; i < off_s.size(); ++i) moved_s.push_back(influence[i] * off_s[i]);
  return moved_s;
}

// The deceleration's crossing from its own fit, and from the acceleration's less what the two
// transitions of one line differ by.
struct Deceleration {
  double zero_s = 0;
  double slope = 0;
  double own = 1;   // weight of its own fit
  double form = 0;  // variance from what the priors leave open, s^2
};

Deceleration WeighDeceleration(const TransitionCrossings& crossings, const Residuals& off) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  const signal::ZeroCrossing& d = crossings.deceleration;
  Deceleration result{d.zero, d.slope, 1, Square(d.bend_shift)};
  if (!crossings.paired) return result;
  const PairedDifference& paired = *crossings.paired;
  const std::vector<double> moved_a_s = MovedBy(off.acceleration, a.influence);
  const std::vector<double> moved_d_s = MovedBy(off.deceleration, d.influence);
  double apart = Square(d.bend_shift);
  for (std::size_t i = 0; i < moved_a_s.size(); ++i) apart += Square(moved_d_s[i] - moved_a_s[i]);
  const double paired_form = Square(paired.form_s / a.slope);
  const double paired_variance = paired.variance() / Square(a.slope);
  const double w = paired.cut_off ? 0 : paired_variance / (paired_variance + apart);
  result.own = w;
  result.zero_s = w * d.zero + (1 - w) * (a.zero - paired.value_s / a.slope);
  result.slope = w * d.slope + (1 - w) * a.slope;
  result.form =
      w * w * Square(d.bend_shift) + (1 - w) * (1 - w) * (paired_form + Square(a.bend_shift));
  return result;
}

// By how far each line moved acceleration, deceleration and tail, s; shape (lines) each.
using Moves = std::array<std::vector<double>, 3>;

Moves MovedBy(const Residuals& off, const TransitionCrossings& crossings, double own) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  Moves moves{MovedBy(off.acceleration, a.influence),
              MovedBy(off.deceleration, crossings.deceleration.influence),
              std::vector<double>(off.acceleration.size())};
  if (crossings.paired) {
    const std::vector<double> apart = MovedBy(off.difference, crossings.paired->influence);
    for (std::size_t i = 0; i < apart.size(); ++i) {
      moves[1][i] = own * moves[1][i] + (1 - own) * (moves[0][i] - apart[i] / a.slope);
    }
  }
  if (crossings.early) {
    moves[2] = Off(MovedBy(off.early, crossings.early->influence), moves[0]);
  }
  return moves;
}

Covariance SumOfProducts(const Moves& moves) {
  Covariance covariance{};
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) {
      covariance[j][k] =
          std::inner_product(moves[j].begin(), moves[j].end(), moves[k].begin(), 0.0);
    }
  }
  return covariance;
}

// How the three go together: the two transitions share the lines, and with them each line's own
// lag.
Covariance ScatterOfTheLines(const TransitionCrossings& crossings, const Moves& moves) {
  Covariance covariance = SumOfProducts(moves);
  // Each fit's own error knows how much of the scatter the fit took out.
  const auto scale = [](double sigma, double variance) {
    return variance > 0 ? sigma / std::sqrt(variance) : 1;
  };
  const double n = static_cast<double>(moves[0].size());
  const double fitted = std::sqrt(n / std::max(1.0, n - 3));
  const std::array<double, 3> scales{
      scale(crossings.acceleration.zero_sigma, covariance[0][0]),
      crossings.paired ? fitted : scale(crossings.deceleration.zero_sigma, covariance[1][1]),
      fitted};
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) covariance[j][k] *= scales[j] * scales[k];
  }
  return covariance;
}

// Of both crossings, less a share of the tail.
PairVariances LessTheTail(const Covariance& lines, double share) {
  const auto together = [&](std::size_t j, std::size_t k) {
    return lines[j][k] - share * (lines[j][2] + lines[k][2]) + share * share * lines[2][2];
  };
  return {together(0, 0), together(1, 1), together(0, 1)};
}

}  // namespace

CrossingPair CorrectCrossings(const Transitions& transitions, const TransitionCrossings& crossings,
                              bool slope_has_scale, const ResponseOptions& options) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  const signal::ZeroCrossing& d = crossings.deceleration;
  const Residuals off = OffTheFits(transitions, crossings);
  const Deceleration whole = WeighDeceleration(crossings, off);
  const Covariance lines = ScatterOfTheLines(crossings, MovedBy(off, crossings, whole.own));

  const double prior = crossings.early ? Square(options.tail_sigma * a.zero) : 0;
  const double seen = prior > 0 ? prior / (prior + lines[2][2]) : 0;
  const double share = options.tail_share * seen;
  CrossingPair pair;
  pair.tail_s = seen * crossings.tail_s();
  pair.tail_share = share;
  pair.own_share = whole.own;
  const PairVariances left = LessTheTail(lines, share);
  const double unseen_tail_s = options.tail_share * std::sqrt((1 - seen) * (1 - seen) * prior);

  // Slip moves the tail too, and with it what is taken off both crossings.
  const double slip_a_s = transitions.acceleration.slip_excess_s / a.slope;
  const double slip_d_s = transitions.deceleration.slip_excess_s / whole.slope;
  const double moved_s =
      crossings.early
          ? share * (slip_a_s - transitions.early->slip_excess_s / crossings.early->slope)
          : 0;

  // What the window's end cuts off is not unread.
  const bool drains = transitions.ramp_s > 0 && a.zero > 0;
  const double full_slope =
      drains ? std::min(options.full_slope,
                        GainOfALinearLag(a.zero, transitions.ramp_s, transitions.drain_s))
             : options.full_slope;

  const auto correct = [&](const signal::ZeroCrossing& fit, double zero_s, double variance,
                           double slip_s) {
    CorrectedCrossing corrected;
    corrected.zero_s = zero_s - share * crossings.tail_s();
    corrected.variance = variance;
    corrected.common.slip = options.slip_sigma * slip_s;
    const double missing = slope_has_scale ? std::max(0.0, full_slope - fit.slope) : 0;
    corrected.common.unread = options.unread_sigma * std::min(1.0, missing) * std::abs(fit.zero);
    const double outside = slope_has_scale ? std::clamp(1 - fit.slope, 0.0, 1.0) : 0;
    const bool short_end = drains && transitions.slow_drain_s < options.paired.least_drain * a.zero;
    const double law = std::max(short_end ? options.short_end_sigma : options.lag_form_sigma,
                                options.lag_tail_sigma * outside) *
                       std::abs(fit.zero);
    corrected.common.form = std::hypot(law, options.tail_share_sigma * pair.tail_s, unseen_tail_s);
    return corrected;
  };
  const auto beyond = [&](const TransitionSeries& series, double zero_s) {
    return Square(options.beyond_sigma * series.Beyond_s(zero_s));
  };
  pair.acceleration =
      correct(a, a.zero,
              left.acceleration + Square(a.bend_shift) + beyond(transitions.acceleration, a.zero),
              slip_a_s + moved_s);
  pair.deceleration = correct(
      d, whole.zero_s, left.deceleration + whole.form + beyond(transitions.deceleration, d.zero),
      slip_d_s - moved_s);
  pair.covariance = left.covariance + (1 - whole.own) * Square(a.bend_shift);
  return pair;
}

PairVariances ScatterAbout(const Transitions& laid, const Transitions& seen,
                           const TransitionCrossings& crossings, const CrossingPair& pair) {
  Covariance lines = SumOfProducts(MovedBy(OffLaid(seen, laid), crossings, pair.own_share));
  // Counts two unknowns that were learnt of the same lines: the lag, and how much filament it
  // moves.
  const double n = static_cast<double>(seen.acceleration.excess_s.size());
  for (auto& row : lines) {
    for (double& of : row) of *= n / std::max(1.0, n - 2);
  }
  return LessTheTail(lines, pair.tail_share);
}

Slip EstimateSlip(const CrossingPair& pair) {
  const CorrectedCrossing& a = pair.acceleration;
  const CorrectedCrossing& d = pair.deceleration;
  const double apart = a.common.slip + d.common.slip;
  const double noise = std::max(0.0, a.variance + d.variance - 2 * pair.covariance) +
                       Square(a.common.form - d.common.form);
  const double total = apart * apart + noise;
  if (!(total > 0)) return {};
  const double per_difference = apart / total;
  return {per_difference * (a.zero_s - d.zero_s), noise / total, per_difference * a.common.slip,
          per_difference * d.common.slip};
}

PairVariances LessSlip(const PairVariances& lines, const Slip& slip) {
  const double a = slip.off_acceleration;
  const double d = slip.on_deceleration;
  const auto together = [&](double of_a, double of_d, double and_a, double and_d) {
    return of_a * and_a * lines.acceleration + of_d * and_d * lines.deceleration +
           (of_a * and_d + of_d * and_a) * lines.covariance;
  };
  return {together(1 - a, a, 1 - a, a), together(d, 1 - d, d, 1 - d), together(1 - a, a, d, 1 - d)};
}

}  // namespace trammel::pressure_advance
