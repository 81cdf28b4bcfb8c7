#include "pressure_advance/response/crossings.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "base/square.h"

namespace trammel::pressure_advance {

double GainOfALinearLag(double lag_s, double ramp_s, double drain_s) {
  return 1 + lag_s / ramp_s * std::expm1(-ramp_s / lag_s) * std::exp(-drain_s / lag_s);
}

LagDrift EstimateLagDrift(double slope, double slope_sigma, double linear_gain, double tail,
                          const LagDriftOptions& options) {
  const double thinning = std::clamp(tail / options.thinning_tail, 0.0, 1.0);
  const double least = linear_gain;
  const double greatest = linear_gain + thinning * (1 - linear_gain);
  const double low = 1 - slope / least;
  const double high = 1 - slope / greatest;
  const double reading = std::hypot((high - low) / std::sqrt(12.0), slope_sigma / least);
  const double prior = options.prior_sigma * options.prior_sigma;
  const double total = prior + reading * reading;
  return {prior / total * (low + high) / 2, reading * std::sqrt(prior / total)};
}

namespace {

// Difference of one line, linear in three unknowns: the value at the answer, the effect of another
// law below it, and the share lost in gaps beyond.
struct Line {
  Eigen::Vector3d form;
  double difference_s = 0;
  double sigma_s = 0;   // from the readings
  double beyond_s = 0;  // deviation from a linear loss
  double robust = 1;    // weight in [0, 1]

  [[nodiscard]] double variance(double scatter_s) const {
    return Square(scatter_s) + Square(sigma_s) + Square(beyond_s);
  }
};

void Place(const std::vector<double>& pa_s, double answer_s, double slope,
           const PairedOptions& options, std::vector<Line>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool below = answer_s > 0 && pa_s[i] < answer_s;
    const double short_of = below ? 1 - Square(pa_s[i] / answer_s) : 0;
    const double past_s = slope * std::max(0.0, pa_s[i] - answer_s);
    lines[i].form = {1 - (1 - options.at_rest) * short_of, short_of, -past_s};
    lines[i].beyond_s = options.distance_sigma * past_s;
  }
}

Eigen::Vector3d Solve(const std::vector<Line>& lines, double scatter_s, double law_sigma_s,
                      const PairedOptions& options, PairedDifference& result) {
  Eigen::Matrix3d data = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right(0, 0, options.loss_mean / Square(options.loss_sigma));
  for (const Line& line : lines) {
    const double weight = line.robust / line.variance(scatter_s);
    data += weight * line.form * line.form.transpose();
    right += weight * line.difference_s * line.form;
  }
  Eigen::Matrix3d prior = Eigen::Matrix3d::Zero();
  prior(1, 1) = 1 / Square(law_sigma_s);
  prior(2, 2) = 1 / Square(options.loss_sigma);
  const Eigen::LDLT<Eigen::Matrix3d> solver(data + prior);
  Eigen::Vector3d solved = solver.solve(right);
  const Eigen::Vector3d row = solver.solve(Eigen::Vector3d::UnitX());
  result.value_s = solved[0];
  result.sigma_s = std::sqrt(std::max(0.0, row.dot(data * row)));
  result.form_s = std::sqrt(row.dot(prior * row));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    result.fitted_s[i] = line.form.dot(solved);
    result.influence[i] = line.robust / line.variance(scatter_s) * row.dot(line.form);
  }
  return solved;
}

// Returns the scatter of the lines about the fit, and sets their weights in the next one.
double Reweight(const Eigen::Vector3d& solved, double scatter_s, double prior_s, bool redescending,
                const PairedOptions& options, std::vector<Line>& lines) {
  constexpr double kPriorLines = 2;
  constexpr double kFitted = 1.5;  // the priors hold the other unknowns
  constexpr double kHuber = 1.345;
  double squares = kPriorLines * Square(prior_s);
  double count = kPriorLines;
  for (Line& line : lines) {
    const double residual_s = line.difference_s - line.form.dot(solved);
    const double near = 1 - Square(line.beyond_s) / line.variance(scatter_s);
    squares += line.robust * near * Square(residual_s);
    count += line.robust * near;
    const double pull = std::abs(residual_s) / std::sqrt(line.variance(scatter_s));
    line.robust = !redescending ? std::min(1.0, kHuber / std::max(pull, 1e-12))
                  : pull >= options.outlier_scale
                      ? 0
                      : Square(1 - Square(pull / options.outlier_scale));
  }
  return std::sqrt(squares / std::max(1.0, count - kFitted));
}

void CutOffBelowZero(PairedDifference& difference) {
  const double min_s = -std::sqrt(difference.variance());
  if (difference.value_s >= min_s) return;
  difference.form_s = std::sqrt(difference.variance());
  difference.sigma_s = 0;
  difference.value_s = min_s;
  difference.cut_off = true;
  std::fill(difference.influence.begin(), difference.influence.end(), 0.0);
}

}  // namespace

PairedDifference FitPairedDifference(const TransitionSeries& acceleration,
                                     const TransitionSeries& deceleration, double zero_s,
                                     double slope, double share, const PairedOptions& options) {
  constexpr int kIterations = 12;
  const std::size_t count = acceleration.pa_s.size();
  std::vector<Line> lines(count);
  for (std::size_t i = 0; i < count; ++i) {
    lines[i].difference_s = acceleration.surplus_s[i] - deceleration.surplus_s[i];
    lines[i].sigma_s = std::hypot(acceleration.sigma_s[i], deceleration.sigma_s[i]);
  }
  PairedDifference result;
  result.fitted_s.resize(count);
  result.influence.resize(count);
  const double prior_s = options.scatter_s * slope;
  double scatter_s = prior_s;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double answer_s = zero_s - share * std::max(0.0, result.value_s) / slope;
    Place(acceleration.pa_s, answer_s, slope, options, lines);
    const double law_sigma_s = std::hypot(options.at_rest_sigma * result.value_s,
                                          options.law_sigma * std::max(answer_s, 1e-4) * slope);
    const Eigen::Vector3d solved = Solve(lines, scatter_s, law_sigma_s, options, result);
    scatter_s = Reweight(solved, scatter_s, prior_s, iteration >= kIterations / 2, options, lines);
  }
  CutOffBelowZero(result);
  return result;
}

namespace {

std::optional<signal::ZeroCrossing> FitSeen(const TransitionSeries& series,
                                            const signal::ZeroCrossingOptions& form) {
  std::vector<std::size_t> seen;
  std::vector<double> pa_s, surplus_s, sigma_s;
  for (std::size_t i = 0; i < series.pa_s.size(); ++i) {
    if (!std::isfinite(series.sigma_s[i])) continue;
    seen.push_back(i);
    pa_s.push_back(series.pa_s[i]);
    surplus_s.push_back(series.surplus_s[i]);
    sigma_s.push_back(series.sigma_s[i]);
  }
  auto fit = signal::FitZeroCrossing(pa_s, surplus_s, sigma_s, form);
  if (!fit || seen.size() == series.pa_s.size()) return fit;
  const auto spread = [&](std::vector<double>& values) {
    std::vector<double> all(series.pa_s.size(), 0);
    for (std::size_t k = 0; k < seen.size(); ++k) all[seen[k]] = values[k];
    values = std::move(all);
  };
  spread(fit->weight);
  spread(fit->influence);
  fit->fitted.clear();
  for (const double pa : series.pa_s) fit->fitted.push_back(signal::ResponseAt(*fit, pa));
  return fit;
}

std::optional<PairedDifference> FitDifference(const Transitions& transitions,
                                              const TransitionCrossings& crossings,
                                              const ResponseOptions& options) {
  const TransitionSeries& a = transitions.acceleration;
  const TransitionSeries& d = transitions.deceleration;
  const signal::ZeroCrossing& zero = crossings.acceleration;
  if (!crossings.early || !(transitions.ramp_s > 0) || !(zero.slope > 0)) return std::nullopt;
  if (a.SeenPa_s().size() < a.pa_s.size() || d.SeenPa_s().size() < a.pa_s.size()) {
    return std::nullopt;
  }
  // Filament beyond the end of the deceleration's window would resemble slip.
  if (transitions.slow_drain_s < options.paired.min_drain * zero.zero) return std::nullopt;
  // Early and whole window share the lines: the tail's sigma is half of the crossing's.
  const double prior = Square(options.tail_sigma * zero.zero);
  const double noise = Square(zero.zero_sigma / 2);
  const double tail_s =
      prior > 0 ? options.tail_share * crossings.tail_s() * prior / (prior + noise) : 0;
  return FitPairedDifference(a, d, zero.zero - tail_s, zero.slope,
                             a.slip_surplus_s / (a.slip_surplus_s + d.slip_surplus_s),
                             options.paired);
}

}  // namespace

std::vector<double> TransitionSeries::SeenPa_s() const {
  std::vector<double> seen;
  for (std::size_t i = 0; i < pa_s.size(); ++i) {
    if (std::isfinite(sigma_s[i])) seen.push_back(pa_s[i]);
  }
  return seen;
}

double TransitionSeries::Beyond_s(double zero_s) const {
  const std::vector<double> seen = SeenPa_s();
  if (seen.size() == pa_s.size() || seen.empty()) return 0;
  const auto [least, most] = std::minmax_element(seen.begin(), seen.end());
  return std::max({0.0, *least - zero_s, zero_s - *most});
}

std::optional<TransitionCrossings> FitTransitions(const Transitions& transitions,
                                                  const ResponseOptions& options) {
  auto acceleration = FitSeen(transitions.acceleration, options.acceleration);
  auto deceleration = FitSeen(transitions.deceleration, options.deceleration);
  if (!acceleration || !deceleration) return std::nullopt;
  TransitionCrossings crossings{*std::move(acceleration), *std::move(deceleration), std::nullopt,
                                std::nullopt};
  if (transitions.early) crossings.early = FitSeen(*transitions.early, options.acceleration);
  crossings.paired = FitDifference(transitions, crossings, options);
  return crossings;
}

namespace {

// Covariance of acceleration, deceleration and tail, in this order; s^2.
using Covariance = std::array<std::array<double, 3>, 3>;

// Residuals of each line's surpluses, and of their difference, from others, s; shape (lines) each.
struct Residuals {
  std::vector<double> acceleration, deceleration, early, difference;
};

std::vector<double> Off(const std::vector<double>& seen, const std::vector<double>& other) {
  std::vector<double> off;
  for (std::size_t i = 0; i < seen.size(); ++i) off.push_back(seen[i] - other[i]);
  return off;
}

Residuals OffTheFits(const Transitions& seen, const TransitionCrossings& crossings) {
  Residuals off{.acceleration = Off(seen.acceleration.surplus_s, crossings.acceleration.fitted),
                .deceleration = Off(seen.deceleration.surplus_s, crossings.deceleration.fitted)};
  if (crossings.early) off.early = Off(seen.early->surplus_s, crossings.early->fitted);
  if (crossings.paired) {
    off.difference = Off(Off(seen.acceleration.surplus_s, seen.deceleration.surplus_s),
                         crossings.paired->fitted_s);
  }
  return off;
}

Residuals OffLaid(const Transitions& seen, const Transitions& laid) {
  Residuals off{.acceleration = Off(seen.acceleration.surplus_s, laid.acceleration.surplus_s),
                .deceleration = Off(seen.deceleration.surplus_s, laid.deceleration.surplus_s)};
  if (seen.early) off.early = Off(seen.early->surplus_s, laid.early->surplus_s);
  off.difference = Off(off.acceleration, off.deceleration);
  return off;
}

// Computes the shift of a value by each line's residual, s.
std::vector<double> MovedBy(const std::vector<double>& off_s,
                            const std::vector<double>& influence) {
  std::vector<double> moved_s;
  for (std::size_t i = 0; i < off_s.size(); ++i) moved_s.push_back(influence[i] * off_s[i]);
  return moved_s;
}

// Deceleration's crossing from its own fit, and from the acceleration's minus the lines' paired
// difference.
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

// Shift of acceleration, deceleration and tail by each line, s; shape (lines) each.
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

// Computes the covariance of the three: the two transitions share the lines, and with them each
// line's own lag.
Covariance ScatterOfTheLines(const TransitionCrossings& crossings, const Moves& moves) {
  Covariance covariance = SumOfProducts(moves);
  // Each fit's own error includes how much of the scatter the fit absorbed.
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

// Computes the crossings' variances, less a share of the tail.
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

  // Slip also shifts the tail, and with it the correction of both crossings.
  const double slip_a_s = transitions.acceleration.slip_surplus_s / a.slope;
  const double slip_d_s = transitions.deceleration.slip_surplus_s / whole.slope;
  const double moved_s =
      crossings.early
          ? share * (slip_a_s - transitions.early->slip_surplus_s / crossings.early->slope)
          : 0;

  // Filament beyond the window's end is not unread.
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
    const bool short_end = drains && transitions.slow_drain_s < options.paired.min_drain * a.zero;
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
  // Accounts for two unknowns estimated from the same lines: the lag, and the filament it moves.
  const double n = static_cast<double>(seen.acceleration.surplus_s.size());
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
