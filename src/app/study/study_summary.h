// What all scans of one condition say together.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/study/study_paper.h"
#include "app/study/study_scan.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::app {

/// Values that one method gave, one a pattern.
struct ChosenValues {
  std::vector<double> value_s;
  int within_step = 0;  ///< of them not farther from their mean than one step of the pattern
};

/// A straight line through the response of all lines of all patterns.
struct AggregateLine {
  double offset_s = 0;
  double slope = 0;  ///< of the excess over the pressure advance; -1 at best
  double r_squared = 0;
  std::optional<double> zero_s;
};

struct StudySummary {
  sim::Condition condition;
  std::vector<StudyScan> scans;
  double step_s = 0;  ///< between the lines of the pattern; 0 without scans
  ChosenValues deviation;
  pressure_advance::DeviationResult aggregate;  ///< the paper's cubic over all scores
  /// Largest factor between that cubic and the paper's over the tested range, >= 1; absent where
  /// either is not above 0.
  std::optional<double> curve_factor;
  ChosenValues response;        ///< good answers alone
  std::vector<double> error_s;  ///< of these, same order
  int covered = 0;              ///< of these: the truth lies in the 95 % interval
  std::optional<AggregateLine> line;
  std::optional<StudyValidation> validation;
};

/// @param scans  of one condition, in any order.
[[nodiscard]] StudySummary Summarize(const sim::Condition& condition, std::vector<StudyScan> scans,
                                     std::optional<StudyValidation> validation);

/// Share by which the calibrated lines deviate less; absent where the control does not deviate.
[[nodiscard]] std::optional<double> ImprovementOf(const StudyValidation& validation);

/// c0 + c1 p + c2 p^2 + c3 p^3.
[[nodiscard]] double CubicAt(const std::vector<double>& cubic, double p);

/// A table with the paper's numbers beside, for people.
[[nodiscard]] std::string SummaryText(const std::vector<StudySummary>& summaries);

}  // namespace trammel::app
