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

// What is left open of a crossing as far as the law is known. What two transitions differ by is
// looked at anew.
BudgetedValue Corrected(const BudgetedValue& seen, const BudgetedValue& twin, const LawFit& law,
                        const LawOptions& options) {
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
  learnt.shared_misfit = law.shared_misfit;
  return learnt;
}

}  // namespace

double TrustIn(const LawFit& law, const LawOptions& options) {
  return std::clamp((options.refuted_misfit - law.shared_misfit) /
                        (options.refuted_misfit - options.trusted_misfit),
                    0.0, 1.0);
}

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

  const double trust = TrustIn(law, options);
  BudgetedValue whole = Corrected(*crossings.whole, *twin.whole, law, options);
  const double law_variance =
      Square(law.sigma_s) + Square(options.law_form_sigma * law.pressure_advance_s);
  const double own = whole.budget.total() - whole.budget.picture;
  // The fit uses all that the crossings use: where its model holds, its own error is in both.
  const double shared = std::min(Square(law.sigma_s), 0.9 * std::min(own, law_variance));
  const double apart = own + law_variance - 2 * shared;
  const double w = trust * std::clamp((own - shared) / apart, 0.0, options.most_weight);
  const double differ_s = law.pressure_advance_s - whole.value_s;
  LearntLaw learnt = Learnt(law, options);
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
  // Of what the transitions differed by, the law may explain a part.
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
