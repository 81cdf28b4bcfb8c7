#include "pressure_advance/response/uncertainty_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

const char* Blame(const UncertaintyBudget& budget) {
  const std::pair<double, const char*> causes[] = {
      {budget.lines,
       "the lines scatter too much; print more lines, or clean the plate and scan again"},
      {budget.slip,
       "flow that may be lost at the fast speed stays open, as the two changes of speed are not "
       "read "
       "equally well; print with a lower fast speed, or scan again with less ambient light"},
      {budget.unread,
       "too much of the filament that pressure advance moves is not read; widen the crop (crop_px) "
       "if beads reach out of it, print longer lines if they are too short for this lag"},
      {budget.form, "the lag outlasts the fast part of the lines; print longer ones"},
      {budget.drift,
       "the lag seems to drift from line to line; let the hot end settle, and print a pattern with "
       "the answer in its middle"},
      {budget.apart,
       "the two changes of speed contradict each other; print with a lower fast speed"},
      {budget.picture, "the photo is too blurred or too small; take a sharp one from nearer"}};
  return std::max_element(std::begin(causes), std::end(causes),
                          [](const auto& a, const auto& b) { return a.first < b.first; })
      ->second;
}

}  // namespace

double HalfWidth95(const UncertaintyBudget& budget, double freedom) {
  const double ratio = budget.lines > 0 ? budget.total() / budget.lines : 1e6;
  return StudentT95(freedom * ratio * ratio) * std::sqrt(budget.total());
}

RangedAnswer JudgeByBudget(double value_s, const UncertaintyBudget& budget, double freedom,
                           const Interval& tested_s, double widest) {
  const double half = HalfWidth95(budget, freedom);
  const std::string too_wide = fmt::format(
      "the 95 % interval would reach {:.2g} s to either side on a tested range of "
      "{:.2g} s: {}",
      half, tested_s.hi - tested_s.lo, Blame(budget));
  return JudgeInRange(value_s, std::sqrt(budget.total()), half, tested_s, widest, too_wide);
}

}  // namespace trammel::pressure_advance
