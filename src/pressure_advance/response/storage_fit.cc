#include "pressure_advance/response/storage_fit.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "pressure_advance/response/storage_line.h"

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::VectorXd;

constexpr double kFirstDamping = 1e-3;

// Constants of a fit.
struct Pattern {
  HeadMotion head;
  LagModel model;
  StorageOptions options;
  StoragePrior prior;

  Pattern(const LineMotion& motion, const StorageOptions& law_options)
      : head(motion), model(head, {}), options(law_options), prior(StoragePriorOf()) {}
};

double Misfit(const std::vector<StorageLine>& lines, const Pattern& pattern,
              const StorageState& state) {
  double sum = 0;
  const auto laid = LayAll(pattern.model.With(LagOf(state.theta)), state.theta, lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const VectorXd off = lines[i].Off(state, laid[i]);
    sum += lines[i].weight * off.dot(lines[i].covariance.Solve(off).col(0));
  }
  const StorageVector away = state.theta - pattern.prior.mean;
  return sum + away.dot(pattern.prior.information * away);
}

// Estimates the scatter of the lines' own lags and levels, and the misfit.
void Learn(std::vector<StorageLine>& lines, const StorageState& before,
           const StorageOptions& options, StorageState& state) {
  const double prior_s = options.lag_scatter * before.theta(kLagSeconds);
  double lag = options.seen_lines * Square(prior_s);
  double flow = options.seen_lines * Square(options.flow_scatter);
  double place = options.seen_lines * Square(options.place_scatter_mm);
  std::vector<double> pulls, misfits;
  // Returns the expected square of a deviation common to a line, given its readings.
  const auto expected = [](double variance, double weighed, double information) {
    return Square(variance * weighed) + variance - Square(variance) * information;
  };
  for (StorageLine& line : lines) {
    Eigen::MatrixXd columns(line.value.size(), 4);
    columns << line.value - line.mean, line.own, line.mean, line.slope;
    const Eigen::MatrixXd solved = line.covariance.Solve(columns);
    const VectorXd diagonal = line.covariance.InverseDiagonal();
    misfits.push_back(columns.col(0).dot(solved.col(0)) / static_cast<double>(columns.rows()));
    lag += expected(Square(before.lag_scatter_s), line.own.dot(solved.col(0)),
                    line.own.dot(solved.col(1)));
    flow += expected(Square(before.flow_scatter), line.mean.dot(solved.col(0)),
                     line.mean.dot(solved.col(2)));
    place += expected(Square(before.place_scatter_mm), line.slope.dot(solved.col(0)),
                      line.slope.dot(solved.col(3)));
    for (Index i = 0; i < diagonal.size(); ++i) {
      constexpr double kBelieved = 3, kMaxDoubt = 1e4;
      const double pull = solved(i, 0) / std::sqrt(diagonal(i)) * std::sqrt(line.doubt(i));
      pulls.push_back(std::abs(pull));
      line.doubt(i) = std::clamp(Square(pull / kBelieved), 1.0, kMaxDoubt);
    }
  }
  // A line with a blob on it fits its neighbours, but no model of a line.
  constexpr double kBelievedMisfit = 2.5;  // over the median one
  const double most = kBelievedMisfit * Median(misfits);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i].weight = misfits[i] > most ? Square(most / misfits[i]) : 1;
  }
  constexpr double kMedianPull = 0.6745;  // normal distribution's
  const double n = static_cast<double>(lines.size()) - 1 + options.seen_lines;
  state.lag_scatter_s = std::sqrt(lag / n);
  state.flow_scatter = std::sqrt(flow / n);
  state.place_scatter_mm = std::sqrt(place / n);
  state.noise = std::clamp(before.noise * Square(Median(pulls) / kMedianPull), 0.01, 100.0);
}

// Step towards the minimum misfit.
struct Step {
  StorageMatrix information;
  double length = 0;  // in standard deviations
};

// REQUIRES lines that are linearised and weighted at the state.
Step Improve(const Pattern& pattern, const std::vector<StorageLine>& lines, StorageState& state,
             double& damping) {
  constexpr int kAttempts = 6;
  constexpr double kMinDamping = 1e-6;
  Step step{pattern.prior.information, 0};
  StorageVector right = pattern.prior.information * (pattern.prior.mean - state.theta);
  double before = (state.theta - pattern.prior.mean).dot(-right);
  for (const StorageLine& line : lines) {
    const VectorXd off = line.value - line.mean;
    Eigen::MatrixXd columns(off.size(), kUnknowns + 1);
    columns << line.gradient, off;
    const Eigen::MatrixXd solved = line.weight * line.covariance.Solve(columns);
    step.information += line.gradient.transpose() * solved.leftCols(kUnknowns);
    right += line.gradient.transpose() * solved.col(kUnknowns);
    before += off.dot(solved.col(kUnknowns));
  }
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    StorageMatrix damped = step.information;
    damped.diagonal() *= 1 + damping;
    StorageState next = state;
    next.theta += geometry::SolveSymmetric(damped, right);
    Bound(next.theta);
    if (Misfit(lines, pattern, next) <= before) {
      const StorageVector moved = next.theta - state.theta;
      step.length = std::sqrt(moved.dot(step.information * moved));
      state = next;
      damping = std::max(kMinDamping, damping / 5);
      break;
    }
    damping = std::max(kFirstDamping, damping * 10);
  }
  return step;
}

// Returns minus twice the log-likelihood, up to a constant.
double Unlikeliness(const Pattern& pattern, std::vector<StorageLine>& lines,
                    const StorageState& state) {
  Linearise(pattern.model, state, lines);
  Weigh(state, pattern.options, lines);
  double sum = Misfit(lines, pattern, state);
  for (const StorageLine& line : lines) sum += line.covariance.LogDeterminant();
  return sum;
}

// A one-stage melt may look like a poor two-stage one, and vice versa: starts with the better of
// the two after a few steps.
StorageState Begin(const Pattern& pattern, double lag_s, std::vector<StorageLine>& lines) {
  constexpr int kSteps = 4;
  StorageState best;
  double least = std::numeric_limits<double>::infinity();
  for (const double second : {0.02, 0.3}) {
    StorageState state;
    state.theta = pattern.prior.mean;
    state.theta(kLevel) = 1;
    state.theta(kLagSeconds) = lag_s;
    state.theta(kSecondStage) = second;
    state.lag_scatter_s = pattern.options.lag_scatter * lag_s;
    state.flow_scatter = pattern.options.flow_scatter;
    state.place_scatter_mm = pattern.options.place_scatter_mm;
    double damping = kFirstDamping;
    for (int i = 0; i < kSteps; ++i) {
      Linearise(pattern.model, state, lines);
      Weigh(state, pattern.options, lines);
      Improve(pattern, lines, state, damping);
    }
    const double unlikeliness = Unlikeliness(pattern, lines, state);
    if (unlikeliness < least) {
      least = unlikeliness;
      best = state;
    }
  }
  return best;
}

// Returns residuals over their own standard deviations, each conditional on all others of its line.
VectorXd Pulls(const StorageLine& line) {
  const VectorXd solved = line.covariance.Solve(line.value - line.mean).col(0);
  return solved.cwiseQuotient(line.covariance.InverseDiagonal().cwiseSqrt());
}

// REQUIRES lines that are linearised and weighted, in print order.
double SharedMisfit(const std::vector<StorageLine>& lines) {
  constexpr double kMaxApart_mm = 0.5;
  double both = 0, each = 0;
  std::vector<double> before_mm;
  VectorXd before;
  for (const StorageLine& line : lines) {
    const VectorXd pulls = Pulls(line);
    std::size_t k = 0;  // the nearest reading of the line before
    for (std::size_t i = 0; i < line.position_mm.size() && !before_mm.empty(); ++i) {
      const double at = line.position_mm[i];
      while (k + 1 < before_mm.size() &&
             std::abs(before_mm[k + 1] - at) < std::abs(before_mm[k] - at)) {
        ++k;
      }
      if (std::abs(before_mm[k] - at) > kMaxApart_mm) continue;
      const double here = pulls(static_cast<Index>(i)), there = before(static_cast<Index>(k));
      both += here * there;
      each += (Square(here) + Square(there)) / 2;
    }
    before_mm = line.position_mm;
    before = pulls;
  }
  return each > 0 ? both / each : 0;
}

// Computes the unknowns of interest: the right pressure advance, the lag at the slow and at the
// fast speed, slip.
constexpr int kAsked = 4;
Eigen::Matrix<double, kAsked, 1> Answers(const HeadMotion& head, const LagModel& model) {
  return {model.RightPressureAdvance(), model.LagAt(head.slow_mm_s()),
          model.LagAt(head.fast_mm_s()), model.lag().slip};
}

StorageFit Report(const Pattern& pattern, const StorageState& state,
                  const StorageMatrix& information) {
  StorageFit fit;
  fit.lag = LagOf(state.theta);
  const LagModel model = pattern.model.With(fit.lag);
  const Eigen::Matrix<double, kAsked, 1> answers = Answers(pattern.head, model);
  Eigen::Matrix<double, kUnknowns, kAsked> slope;
  slope.setZero();
  for (int k = 0; k < kLagUnknowns; ++k) {
    double step = 0;
    const LagModel moved = model.With(Moved(fit.lag, k, step));
    slope.row(kOfLag + k) = (Answers(pattern.head, moved) - answers).transpose() / step;
  }
  const Eigen::MatrixXd solved = geometry::SolveSymmetric(information, slope);
  const auto fitted = [&](int k) -> Fitted {
    return {answers(k), std::sqrt(slope.col(k).dot(solved.col(k)))};
  };
  fit.pressure_advance_s = fitted(0).value;
  fit.sigma_s = fitted(0).sigma;
  fit.slow_lag_s = fitted(1);
  fit.fast_lag_s = fitted(2);
  fit.slip = fitted(3);
  fit.level = state.theta(kLevel);
  fit.drift = state.theta(kDrift);
  fit.tilt = state.theta(kTilt);
  fit.swell = state.theta(kSwell);
  fit.power = state.theta(kPower);
  fit.place_mm = state.theta(kPlace);
  fit.lag_scatter_s = state.lag_scatter_s;
  return fit;
}

}  // namespace

std::optional<StorageFit> FitStorage(const std::vector<LineProfile>& profiles,
                                     const LineMotion& motion, double lag_s,
                                     const Interval& span_mm, const StorageOptions& options) {
  constexpr std::size_t kFewestLines = 4;
  constexpr double kMinLag_s = 0.001;
  constexpr int kMax = 14, kLearnEvery = 2, kLearnings = 4;
  constexpr double kShort = 0.05;
  std::vector<StorageLine> lines;
  std::vector<double> all, pa_s;
  for (const LineProfile& profile : profiles) {
    std::optional<StorageLine> line = StorageLineOf(profile, span_mm, *motion.length_mm);
    if (!line) continue;
    all.insert(all.end(), line->value.begin(), line->value.end());
    pa_s.push_back(line->pressure_advance_s);
    lines.push_back(*std::move(line));
  }
  if (lines.size() < kFewestLines) return std::nullopt;
  const double unit = Median(all);
  const double middle_s = Mean(pa_s);
  const double range_s =
      *std::max_element(pa_s.begin(), pa_s.end()) - *std::min_element(pa_s.begin(), pa_s.end());
  if (!(unit > 0) || !(range_s > 0)) return std::nullopt;
  for (StorageLine& line : lines) {
    line.value /= unit;
    line.variance /= unit * unit;
    line.along = (line.pressure_advance_s - middle_s) / range_s;
  }
  const Pattern pattern(motion, options);
  StorageState state = Begin(pattern, std::max(lag_s, kMinLag_s), lines);
  double damping = kFirstDamping;
  Step step;
  for (int i = 0; i < kMax; ++i) {
    Linearise(pattern.model, state, lines);
    Weigh(state, options, lines);
    // The scatter is estimated every second step, until it hardly changes.
    if (i % kLearnEvery == 0 && i / kLearnEvery < kLearnings) {
      Learn(lines, StorageState(state), options, state);
      Weigh(state, options, lines);
    }
    step = Improve(pattern, lines, state, damping);
    if (i / kLearnEvery >= kLearnings - 1 && step.length < kShort) break;
  }
  StorageFit fit = Report(pattern, state, step.information);
  if (!std::isfinite(fit.pressure_advance_s) || !(fit.sigma_s > 0) || !std::isfinite(fit.sigma_s)) {
    return std::nullopt;
  }
  fit.shared_misfit = SharedMisfit(lines);
  fit.level *= unit;
  fit.middle_s = middle_s;
  fit.range_s = range_s;
  fit.lines = static_cast<int>(lines.size());
  return fit;
}

std::vector<LineProfile> LayLines(const StorageFit& law, std::vector<LineProfile> profiles,
                                  const LineMotion& motion) {
  const HeadMotion head(motion);
  const LagModel model(head, law.lag);
  for (LineProfile& profile : profiles) {
    std::vector<double> positions_mm;
    for (const ProfileSample& sample : profile.samples) {
      positions_mm.push_back(sample.position + profile.heading * law.place_mm);
    }
    const double along = (profile.pressure_advance_s - law.middle_s) / law.range_s;
    const LagModel::Line line{LagSecondsAt(law.lag.lag_s, law.drift, along),
                              profile.pressure_advance_s, positions_mm};
    const std::vector<double> areas = model.Lay({&line, 1}).front();
    for (std::size_t i = 0; i < areas.size(); ++i) {
      Seen& area = profile.samples[i].area;
      if (!area.seen()) continue;
      const double read = ReadArea(areas[i], law.swell, law.power);
      const double laid =
          law.level * (1 + law.tilt * (positions_mm[i] / *motion.length_mm - 0.5)) * read;
      area.value = laid;
    }
  }
  return profiles;
}

namespace {

// Corrects a crossing and its uncertainty, given the storage model. The difference of two
// transitions is tested anew.
BudgetedValue Corrected(const BudgetedValue& seen, const BudgetedValue& twin, const StorageFit& law,
                        const StorageOptions& options) {
  const double trust = TrustIn(law, options);
  const double error_s = trust * ((seen.value_s + twin.value_s) / 2 - law.pressure_advance_s);
  const double open = 1 - Square(trust);
  BudgetedValue corrected{seen.value_s - error_s, seen.budget};
  UncertaintyBudget& budget = corrected.budget;
  budget.slip *= open;
  budget.unread *= open;
  budget.drift *= open;
  budget.apart = 0;
  budget.form = open * budget.form + Square(options.error_sigma * error_s) +
                Square(options.form_sigma * law.pressure_advance_s);
  return corrected;
}

// Widens the answer by the difference of two values beyond twice its standard uncertainty.
// @returns the difference in standard uncertainties, if it exceeds two
std::optional<double> Widen(double differ_s, double variance, UncertaintyBudget& budget) {
  const double beyond = Square(differ_s) - 4 * variance;
  if (beyond <= 0) return std::nullopt;
  budget.apart += beyond / 12;
  return std::abs(differ_s) / std::sqrt(variance);
}

Quantity Budgeted(const BudgetedValue& answer, double freedom) {
  const double half_s = HalfWidth95(answer.budget, freedom);
  return {answer.value_s,
          std::sqrt(answer.budget.total()),
          {std::max(0.0, answer.value_s - half_s), answer.value_s + half_s}};
}

// Returns the fit's value, widened by other models' errors; at least 0.
Quantity OfTheFit(const Fitted& fitted, double form, double most) {
  const double u = std::hypot(fitted.sigma, form);
  return {
      fitted.value,
      u,
      {std::max(0.0, fitted.value - kNormal95 * u), std::min(most, fitted.value + kNormal95 * u)}};
}

WeighedStorage Learnt(const StorageFit& law, const StorageOptions& options) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const auto lag = [&](const Fitted& fitted) {
    return OfTheFit(fitted, options.lag_form_sigma * fitted.value, kAny);
  };
  WeighedStorage learnt;
  learnt.slow_lag_s = lag(law.slow_lag_s);
  learnt.fast_lag_s = lag(law.fast_lag_s);
  learnt.slip = OfTheFit(law.slip, options.slip_form_sigma, 1);
  learnt.lag_scatter_s = law.lag_scatter_s;
  learnt.lines = law.lines;
  learnt.shared_misfit = law.shared_misfit;
  return learnt;
}

}  // namespace

double TrustIn(const StorageFit& law, const StorageOptions& options) {
  return std::clamp((options.refuted_misfit - law.shared_misfit) /
                        (options.refuted_misfit - options.trusted_misfit),
                    0.0, 1.0);
}

WeighedStorage WeighWithStorage(const StorageFit& law, const CombinedTransitions& twin,
                                const StorageOptions& options, CombinedTransitions& crossings) {
  const auto judged = [&](const BudgetedValue& answer) {
    return JudgeByBudget(answer.value_s, answer.budget, crossings.freedom, crossings.tested,
                         crossings.widest);
  };
  const auto one = [&](BudgetedValue& seen, const BudgetedValue& of_twin, double& shift_s) {
    const BudgetedValue corrected = Corrected(seen, of_twin, law, options);
    shift_s += corrected.value_s - seen.value_s;
    seen = corrected;
    return judged(corrected).pressure_advance;
  };
  crossings.acceleration = one(*crossings.first, *twin.first, crossings.acceleration_shift_s);
  crossings.deceleration = one(*crossings.second, *twin.second, crossings.deceleration_shift_s);

  const double trust = TrustIn(law, options);
  BudgetedValue whole = Corrected(*crossings.whole, *twin.whole, law, options);
  const double law_variance =
      Square(law.sigma_s) + Square(options.law_form_sigma * law.pressure_advance_s);
  const double own = whole.budget.total() - whole.budget.picture;
  // The fit uses all data of the crossings: if its model is valid, its own error is in both.
  const double shared = std::min(Square(law.sigma_s), 0.9 * std::min(own, law_variance));
  const double apart = own + law_variance - 2 * shared;
  const double w = trust * std::clamp((own - shared) / apart, 0.0, options.max_weight);
  const double differ_s = law.pressure_advance_s - whole.value_s;
  WeighedStorage learnt = Learnt(law, options);
  BudgetedValue of_law{law.pressure_advance_s, {}};
  of_law.budget.lines = Square(law.sigma_s);
  of_law.budget.form = law_variance - Square(law.sigma_s);
  learnt.pressure_advance_s = Budgeted(of_law, crossings.freedom);
  learnt.crossings_s = Budgeted(whole, crossings.freedom);
  learnt.correction_s = crossings.whole->value_s - whole.value_s;
  learnt.weight = w;
  whole.value_s += w * differ_s;
  const double rest = Square(1 - w);
  UncertaintyBudget& budget = whole.budget;
  budget.lines = Square(w * law.sigma_s) + rest * budget.lines + 2 * w * (1 - w) * shared;
  budget.form = Square(w) * of_law.budget.form + rest * budget.form +
                Square(options.shift_sigma * (whole.value_s - crossings.whole->value_s));
  budget.slip *= rest;
  budget.unread *= rest;
  budget.drift *= rest;
  // The storage model may explain a part of the transitions' difference.
  crossings.notices.clear();
  const BudgetedValue& a = *crossings.first;
  const BudgetedValue& d = *crossings.second;
  if (const auto sigmas = Widen(a.value_s - d.value_s,
                                a.budget.lines + a.budget.form + a.budget.slip + d.budget.lines +
                                    d.budget.form + d.budget.slip,
                                budget)) {
    crossings.notices.push_back(NoticeOfTransitions(a.value_s, d.value_s, *sigmas));
  }
  if (trust < 1) {
    crossings.notices.push_back(fmt::format(
        "neighbouring lines differ from the learnt law in the same way (correlation {:.2f}), as "
        "where an extruder follows another law: it counts for {:.0f} % of its usual weight",
        law.shared_misfit, 100 * trust));
  }
  if (const auto sigmas = Widen(trust * differ_s, apart, budget)) {
    crossings.notices.push_back(fmt::format(
        "the shape of the lines ({:.4f} s) and what the changes of speed leave over ({:.4f} s) "
        "suggest values that differ by {:.1f} standard uncertainties; the answer's uncertainty was "
        "widened for it",
        law.pressure_advance_s, whole.value_s - w * differ_s, *sigmas));
  }
  crossings.whole = whole;
  crossings.both = judged(whole);
  return learnt;
}

}  // namespace trammel::pressure_advance
