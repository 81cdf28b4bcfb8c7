// Observations of a survey, written to a file and read again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/survey/survey.h"

namespace trammel::files {

/// `{"format": 1, "pictures": [{"name", "image_px", "observations": [{"target", "column_px",
/// "row_px", "sigma_px", and if need be "disc_px" (semi-axes), "disc_angle_rad"}], and if need be
/// "plain_points": the same without "target"}]}` (docs/reference/formats.md). Errors (kInput) name
/// file and place.
[[nodiscard]] Result<std::vector<part_alignment::SurveyPicture>> ReadSurveyFile(
    const std::filesystem::path& path);

/// Writes a survey file as text with a final newline; ReadSurveyFile reads every number back to the
/// last bit.
[[nodiscard]] std::string SurveyFileText(
    const std::vector<part_alignment::SurveyPicture>& pictures);

/// Reads the list `scale_bars` of a file, also of PART.json: other keys are skipped. Errors
/// (kInput): no such list; a bar that lacks one of its four keys or has a number out of range.
[[nodiscard]] Result<std::vector<part_alignment::ScaleBar>> ReadScaleBarFile(
    const std::filesystem::path& path);

}  // namespace trammel::files
