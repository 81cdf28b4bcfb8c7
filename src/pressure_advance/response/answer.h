// Checks a value against its uncertainty, the tested range and repeated patterns.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::pressure_advance {

/// Returns minimum and maximum of the values. REQUIRES at least one.
[[nodiscard]] Interval RangeOf(std::span<const double> pressure_advance_s);

/// Returns the range to print next if the answer is about `about_s`: as wide as the tested one,
/// centred on that value, and wider at both ends by the extrapolated distance; nothing below 0.
[[nodiscard]] Interval PrintNext(double about_s, const Interval& tested_s);

/// Checks a value against the tested range.
///
/// Nothing was measured beyond the printed lines: an interval that reaches past an edge is no
/// answer. 0 is no such edge, as no extruder leads: a range from 0 on has no lower edge, and value
/// and interval are cut off at 0.
/// @param half_width95_s  of the 95 % interval, >= 0
/// @param widest          maximum half width, as a part of the tested range; > 0
/// @returns good; cannot-tell with the range to print next if the interval reaches past an edge;
///   cannot-tell with `too_wide` as its reason if it is inside and too wide.
[[nodiscard]] RangedAnswer JudgeInRange(double value_s, double standard_uncertainty_s,
                                        double half_width95_s, const Interval& tested_s,
                                        double widest, const std::string& too_wide);

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

/// Returns half of the 95 % interval, with Student's t for the lines' contribution (Welch and
/// Satterthwaite).
/// @param freedom  degrees of freedom of budget.lines, > 0
[[nodiscard]] double HalfWidth95(const UncertaintyBudget& budget, double freedom);

/// Checks a value against its budget and the tested range (JudgeInRange). If the interval is too
/// wide, the reason names the largest contribution and how to reduce it.
/// @param freedom  degrees of freedom of budget.lines, > 0
/// @param widest   maximum half width, as a part of the tested range; > 0
[[nodiscard]] RangedAnswer JudgeByBudget(double value_s, const UncertaintyBudget& budget,
                                         double freedom, const Interval& tested_s, double widest);

/// Combines patterns alike: the mean of their values, with what they differ by.
///
/// The value is the mean of the patterns' own, weighed by u_i^2 + t^2; that of the joint fit where
/// a pattern has none of its own. Its interval begins with the joint fit's, as causes that all
/// patterns share do not average out, and is widened by what the patterns' own intervals do not
/// explain: their values are taken for normal about a common one with variances u_i^2 + t^2, t with
/// a half-Cauchy prior, whose long tail lets patterns say otherwise. It then holds 95 % of the
/// normal distributions of variance u^2 + t^2 / n, weighed by how likely each t is: with two
/// patterns the prior counts most, with many the scatter. It is never narrower than the joint one.
/// @param joint      the answer of the lines of all patterns in one fit, s
/// @param pattern_s  the same of each pattern's own lines; those that are not good tell no scatter
/// @param tested_s   by all patterns
/// @param widest     largest half width, as a part of the tested range
[[nodiscard]] std::pair<RangedAnswer, Repeats> CombineRepeats(const Quantity& joint,
                                                              std::vector<Measured> pattern_s,
                                                              const Interval& tested_s,
                                                              double widest);

/// Returns the notice if patterns disagree; else empty.
[[nodiscard]] std::string NoticeOfRepeats(const Repeats& repeats);

}  // namespace trammel::pressure_advance
