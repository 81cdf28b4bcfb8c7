#include "pressure_advance/response/weigh_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/square.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

// What is left open of a crossing where the law is known.
BudgetedValue Corrected(const BudgetedValue& seen, const BudgetedValue& twin, const LawFit& law,
                        const LawOptions& options) {
  const double error_s = (seen.value_s + twin.value_s) / 2 - law.pressure_advance_s;
  BudgetedValue corrected{seen.value_s - error_s, {}};
  corrected.budget.lines = seen.budget.lines;
  corrected.budget.form =
      Square(options.error_sigma * error_s) + Square(options.form_sigma * law.pressure_advance_s);
  corrected.budget.picture = seen.budget.picture;
  return corrected;
}

// Widens the answer by what two values differ beyond twice their standard uncertainty.
// @returns how many of these they differ by, where it does
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

// What the fit says, with what other laws leave open; at least 0.
Quantity OfTheFit(const Fitted& fitted, double form, double most) {
  const double u = std::hypot(fitted.sigma, form);
  return {
      fitted.value,
      u,
      {std::max(0.0, fitted.value - kNormal95 * u), std::min(most, fitted.value + kNormal95 * u)}};
}

LearntLaw Learnt(const LawFit& law, const LawOptions& options) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const auto lag = [&](const Fitted& fitted) {
    return OfTheFit(fitted, options.lag_form_sigma * fitted.value, kAny);
  };
  LearntLaw learnt;
  learnt.slow_lag_s = lag(law.slow_lag_s);
  learnt.fast_lag_s = lag(law.fast_lag_s);
  learnt.slip = OfTheFit(law.slip, options.slip_form_sigma, 1);
  learnt.lag_scatter_s = law.lag_scatter_s;
  learnt.lines = law.lines;
  return learnt;
}

}  // namespace

LearntLaw WeighWithLaw(const LawFit& law, const CombinedTransitions& twin,
                       const LawOptions& options, CombinedTransitions& crossings) {
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

  BudgetedValue whole = Corrected(*crossings.whole, *twin.whole, law, options);
  const double law_variance =
      Square(law.sigma_s) + Square(options.form_sigma * law.pressure_advance_s);
  const double own = whole.budget.lines + whole.budget.form;
  // The fit uses all that the crossings use: where its model holds, its own error is in both.
  const double shared = std::min(Square(law.sigma_s), 0.9 * std::min(own, law_variance));
  const double apart = own + law_variance - 2 * shared;
  const double w = std::clamp((own - shared) / apart, 0.0, options.most_weight);
  const double differ_s = law.pressure_advance_s - whole.value_s;
  LearntLaw learnt = Learnt(law, options);
  BudgetedValue of_law{law.pressure_advance_s, {}};
  of_law.budget.lines = Square(law.sigma_s);
  of_law.budget.form = law_variance - Square(law.sigma_s);
  learnt.pressure_advance_s = Budgeted(of_law, crossings.freedom);
  learnt.crossings_s = Budgeted(whole, crossings.freedom);
  learnt.correction_s = crossings.whole->value_s - whole.value_s;
  learnt.weight = w;
  const double form =
      w * w * (law_variance - Square(law.sigma_s)) + (1 - w) * (1 - w) * whole.budget.form;
  whole.value_s += w * differ_s;
  whole.budget.lines = w * w * Square(law.sigma_s) + (1 - w) * (1 - w) * whole.budget.lines +
                       2 * w * (1 - w) * shared;
  whole.budget.form = form;
  // Of what the transitions differed by, the law may explain a part.
  crossings.notices.clear();
  const BudgetedValue& a = *crossings.first;
  const BudgetedValue& d = *crossings.second;
  if (const auto sigmas =
          Widen(a.value_s - d.value_s,
                a.budget.lines + a.budget.form + d.budget.lines + d.budget.form, whole.budget)) {
    crossings.notices.push_back(NoticeOfTransitions(a.value_s, d.value_s, *sigmas));
  }
  if (const auto sigmas = Widen(differ_s, apart, whole.budget)) {
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
