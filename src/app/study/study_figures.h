// The paper's figures 16 and 17, drawn from the virtual study, for either method.
#pragma once

#include <vector>

#include "app/study/study_summary.h"
#include "document/figure.h"

namespace trammel::app {

/// "study_16_deviation", "study_17_deviation", "study_16_response", "study_17_response". A
/// condition without scans has an empty panel.
[[nodiscard]] std::vector<report::Figure> StudyFigures(const std::vector<StudySummary>& summaries);

/// A page with table and figures.
[[nodiscard]] std::string StudyPage(const std::vector<StudySummary>& summaries,
                                    const std::vector<report::Figure>& figures, int seed);

}  // namespace trammel::app
