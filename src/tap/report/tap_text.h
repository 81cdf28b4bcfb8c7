// What was found in taps, in words and figures for a terminal.
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

/// All of one tap, several lines.
[[nodiscard]] std::string TapText(const AnalysedTap& tap);

/// One tap of many on a line of its own, with the reason below it where it is not good.
[[nodiscard]] std::string TapLine(const AnalysedTap& tap);

/// The mean of the taps where all used ones are at one place, at least two; Student's interval.
[[nodiscard]] std::optional<Quantity> HeightAtOnePlace(const tap::Ensemble& ensemble);

/// One of what many taps say together: "range", "6.94 µm".
struct EnsembleRow {
  std::string name;
  std::string words;
};
/// Of how many taps, how they scatter and drift; without the height.
[[nodiscard]] std::vector<EnsembleRow> EnsembleRows(const tap::Ensemble& ensemble);

/// The same with the height and the outliers; several lines.
[[nodiscard]] std::string EnsembleText(const tap::Ensemble& ensemble,
                                       std::span<const AnalysedTap> taps);

}  // namespace trammel::report
