// What makes an answer uncertain, cause by cause, and the verdict that follows.
#pragma once

#include "base/measured.h"
#include "pressure_advance/response/tested_range.h"

namespace trammel::pressure_advance {

/// Contributions to an answer's variance, s^2; each >= 0.
struct UncertaintyBudget {
  double lines = 0;    ///< scatter of the lines
  double slip = 0;     ///< flow lost at the fast speed
  double unread = 0;   ///< filament that was not read
  double form = 0;     ///< the lag's law, as far as the windows leave it open
  double drift = 0;    ///< a lag that changes over the pattern
  double apart = 0;    ///< disagreement of the two transitions beyond the rest
  double picture = 0;  ///< blur of a photo

  [[nodiscard]] double total() const {
    return lines + slip + unread + form + drift + apart + picture;
  }
};

/// Half of the 95 % interval, with Student's t for the part that the lines contribute (Welch and
/// Satterthwaite).
/// @param freedom  degrees of freedom of budget.lines, > 0
[[nodiscard]] double HalfWidth95(const UncertaintyBudget& budget, double freedom);

/// Judges a value by its budget and the tested range (JudgeInRange). Where the interval is too
/// wide, the reason names the largest contribution and what makes it smaller.
/// @param freedom  degrees of freedom of budget.lines, > 0
/// @param widest   largest half width, as a part of the tested range; > 0
[[nodiscard]] RangedAnswer JudgeByBudget(double value_s, const UncertaintyBudget& budget,
                                         double freedom, const Interval& tested_s, double widest);

}  // namespace trammel::pressure_advance
