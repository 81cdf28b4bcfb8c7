// Where a part is, in words and figures for a terminal.
#pragma once

#include <string>

#include "part_alignment/report/alignment_json.h"

namespace trammel::report {

/// Several lines: the pose with its uncertainty, the clamping, what the views tell, the residuals.
[[nodiscard]] std::string AlignmentText(const AlignmentOutput& output);

/// One to three lines: what the views tell, and what they do not unless `reason` says so already;
/// none where nothing was asked.
[[nodiscard]] std::string ObservabilityText(const part_alignment::Observability& told,
                                            const std::string& reason);

}  // namespace trammel::report
