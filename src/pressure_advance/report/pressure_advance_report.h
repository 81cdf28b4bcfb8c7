// Reports an analysis as text and as an HTML page.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "document/figure.h"
#include "document/interval_text.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::report {

struct AnswerRow {
  std::string name;      ///< "speeding up"
  std::string value;     ///< "0.0368 s"; a verdict where there is none
  std::string interval;  ///< "95 %: 0.0351 to 0.0385 s"; empty where there is none
  std::string note;      ///< plain text
};

/// Returns rows of the storage model, both speed changes, the paper's score and each pattern. None
/// has a number unless analysis.pressure_advance is good.
[[nodiscard]] std::vector<AnswerRow> AnswerRows(const pressure_advance::Analysis& analysis);

/// "the printer lays 3.0 % too little: set the flow ratio to 1.031"; the reason where there is no
/// ratio.
[[nodiscard]] std::string FlowSentence(const pressure_advance::FlowRatio& flow);

/// "at 150 mm/s the lines have 1.2 % less than at 10 mm/s"; empty where no fast stretch is steady.
[[nodiscard]] std::string SlipSentence(const pressure_advance::FlowRatio& flow,
                                       const pressure_advance::LineMotion& motion);

inline const IntervalStyle kFlowRatio{.min_decimals = 3};

struct ReportOptions {
  std::string source;  ///< what was analysed: a folder, a photo; may hold any bytes
  /// Further facts for the head of the page, name and value, in this order: printer, filament,
  /// date, … (the report reads no clock).
  std::vector<std::pair<std::string, std::string>> facts;
};

/// A complete HTML page: nothing is loaded from anywhere, no scripts, pictures inside. Well-formed
/// as XML, too. Text from outside is escaped. Equal input gives equal bytes.
///
/// Unless analysis.pressure_advance is good, the page names no answer: neither in its head, nor
/// for a transition alone, nor from the paper's score. The tested values and each line's readings
/// stay.
/// @param figures  of PressureAdvanceFigures().
[[nodiscard]] std::string PressureAdvanceReport(const pressure_advance::Analysis& analysis,
                                                const std::vector<Figure>& figures,
                                                const ReportOptions& options);

/// "0.0362": with the decimals that its uncertainty makes meaningful, four to six.
[[nodiscard]] std::string SecondsText(double seconds, double standard_uncertainty_s);

}  // namespace trammel::report
