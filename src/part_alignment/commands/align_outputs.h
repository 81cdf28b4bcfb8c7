// What the metrology commands below `trammel align` share: reports and answers.
#pragma once

#include <span>
#include <string>

#include "base/result.h"
#include "document/figure.h"

namespace trammel::app {

/// Writes `page` as report.html and each figure as PNG and SVG into `folder`, which is made if need
/// be. Errors name the file: one that is there already, unless `force`, for example.
[[nodiscard]] Result<void> WriteMetrologyReport(const std::string& folder, const std::string& page,
                                                std::span<const report::Figure> figures,
                                                bool force);

/// Whether the file and the folder of the page (either may be empty: none) can be written; asked
/// before minutes of work.
[[nodiscard]] Result<void> CheckFree(const std::string& out, const std::string& report_folder,
                                     bool force);

/// JSON alone on standard output with `json`, else the text.
void PrintAnswer(bool json, const std::string& json_text, const std::string& text);

}  // namespace trammel::app
