// A survey's answer as text, JSON, a table of points and a page.
#pragma once

#include <string>

#include "part_alignment/survey/survey.h"

namespace trammel::report {

/// One object (docs/reference/formats.md), ended by a newline; what `align solve` takes as targets.
/// What is meant only with verdict good is null otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::Survey& survey);

/// Several lines.
[[nodiscard]] std::string SurveyText(const part_alignment::Survey& survey);

/// The table of points of `align fit`, the column `surface` empty but for plain targets. REQUIRES
/// verdict good.
/// @param surface  that the plain targets lie on; may be empty.
[[nodiscard]] std::string SurveyPoints(const part_alignment::Survey& survey,
                                       const std::string& surface);

/// @param date  as people write it.
[[nodiscard]] std::string SurveyPage(const std::string& date, const part_alignment::Survey& survey);

}  // namespace trammel::report
