// A survey's answer as text, JSON, a table of points and a page.
#pragma once

#include <string>

#include "part_alignment/survey/survey.h"

namespace trammel::report {

/// One object (docs/formats.md), ended by a newline; what `align solve` takes as targets. What is
/// meant only with verdict good is null otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::Survey& survey);

/// Several lines.
[[nodiscard]] std::string SurveyText(const part_alignment::Survey& survey);

/// The table of points of `align fit`, the column `surface` empty. REQUIRES verdict good.
[[nodiscard]] std::string SurveyPoints(const part_alignment::Survey& survey);

/// @param date  as people write it.
[[nodiscard]] std::string SurveyPage(const std::string& date, const part_alignment::Survey& survey);

}  // namespace trammel::report
