// The one-page report of a pressure-advance analysis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {

struct ReportOptions {
  std::string source;  ///< what was analysed: a folder, a photo; may hold any bytes
  /// Further facts for the head of the page, name and value, in this order: printer, filament,
  /// date, … (the report knows no clock).
  std::vector<std::pair<std::string, std::string>> facts;
};

/// A complete HTML page: nothing is loaded from anywhere, no scripts, pictures inside. Well-formed
/// as XML, too. Text from outside is escaped. Equal input gives equal bytes.
///
/// Unless analysis->pressure_advance is good, the page names no answer: neither in its head, nor
/// for a transition alone, nor from the paper's score. The tested values and each line's readings
/// stay. Cost: most of it in PressureAdvanceFigures; below 2 s for ten lines of 100 x 60 heights
/// (pressure_advance_report_test).
[[nodiscard]] std::string PressureAdvanceReport(const AnalysisRun& input,
                                                const ReportOptions& options = {});

/// The same from figures that were already made, to write those to files of their own as well.
[[nodiscard]] std::string PressureAdvanceReport(const AnalysisRun& input,
                                                const std::vector<Figure>& figures,
                                                const ReportOptions& options);

/// "0.0362": with the decimals that its uncertainty makes meaningful, four to six.
[[nodiscard]] std::string SecondsText(double seconds, double standard_uncertainty_s);

}  // namespace trammel::report
