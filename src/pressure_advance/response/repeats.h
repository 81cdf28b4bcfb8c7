// Patterns alike on one plate: what each says by itself, and how far they may differ.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/response/tested_range.h"

namespace trammel::pressure_advance {

struct RepeatOptions {
  /// How much the lag differs from pattern to pattern before it is seen, as a part of the answer:
  /// the median of a half-Cauchy distribution, whose long tail lets patterns say otherwise;
  /// assumed.
  double prior_median = 0.015;
};

/// Combines patterns alike: the mean of their values, with what they differ by.
///
/// The value is the mean of the patterns' own, weighed by u_i^2 + t^2; that of the joint fit where
/// a pattern has none of its own. Its interval begins with the joint fit's, as causes that all
/// patterns share do not average out, and is widened by what the patterns' own intervals do not
/// explain: their values are taken for normal about a common one with variances u_i^2 + t^2, t with
/// the prior of the options. It then holds 95 % of the normal distributions of variance u^2 +
/// t^2 / n, weighed by how likely each t is: with two patterns the prior counts most, with many
/// the scatter. It is never narrower than the joint one.
/// @param joint      the answer of the lines of all patterns in one fit, s
/// @param pattern_s  the same of each pattern's own lines; those that are not good tell no scatter
/// @param tested_s   by all patterns
/// @param widest     largest half width, as a part of the tested range
[[nodiscard]] std::pair<RangedAnswer, Repeats> CombineRepeats(const Quantity& joint,
                                                              std::vector<Measured> pattern_s,
                                                              const Interval& tested_s,
                                                              double widest,
                                                              const RepeatOptions& options = {});

/// What is to be said where patterns disagree; empty where they do not.
[[nodiscard]] std::string NoticeOfRepeats(const Repeats& repeats);

}  // namespace trammel::pressure_advance
