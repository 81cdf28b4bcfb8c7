// Writes a survey's result as text, JSON, a table of points and a page.
#pragma once

#include <string>

#include "part_alignment/survey/survey.h"

namespace trammel::report {

/// Returns one object (docs/reference/formats.md), ended by a newline, which `align solve` reads as
/// targets. Values that need verdict good are null otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::Survey& survey);

/// Several lines.
[[nodiscard]] std::string SurveyText(const part_alignment::Survey& survey);

/// Returns the table of points for `align fit`; the column `surface` is empty except for plain
/// targets. REQUIRES verdict good.
/// @param surface  that has the plain targets; may be empty.
[[nodiscard]] std::string SurveyPoints(const part_alignment::Survey& survey,
                                       const std::string& surface);

/// @param date  as people write it.
[[nodiscard]] std::string SurveyPage(const std::string& date, const part_alignment::Survey& survey);

}  // namespace trammel::report
