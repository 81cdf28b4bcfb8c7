// Results of taps, in words and figures for a terminal.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tap/ensemble/ensemble.h"
#include "tap/report/tap_json.h"

namespace trammel::report {

/// "-0.0053 mm (95 %: -0.0067 to -0.0039 mm)". REQUIRES a good verdict.
[[nodiscard]] std::string ContactText(const tap::TapAnalysis& analysis);

/// Describes one tap in several lines.
[[nodiscard]] std::string TapText(const AnalysedTap& tap);

/// Describes one tap of many in a line, with the reason below it if it is not good.
[[nodiscard]] std::string TapLine(const AnalysedTap& tap);

/// Returns the mean of the taps if all used ones are at one place, at least two; Student's
/// interval.
[[nodiscard]] std::optional<Quantity> HeightAtOnePlace(const tap::Ensemble& ensemble);

/// One result of many taps: "range", "6.94 µm".
struct EnsembleRow {
  std::string name;
  std::string words;
};
/// Lists the number of taps, their scatter and drift, without the height.
[[nodiscard]] std::vector<EnsembleRow> EnsembleRows(const tap::Ensemble& ensemble);

/// Returns these results with the height and the outliers; several lines.
[[nodiscard]] std::string EnsembleText(const tap::Ensemble& ensemble,
                                       std::span<const AnalysedTap> taps);

}  // namespace trammel::report
