// What the pictures of a survey showed, to be kept and read again.
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

/// The same as text, ended by a newline; ReadSurveyFile gives every number back to the last bit.
[[nodiscard]] std::string SurveyFileText(
    const std::vector<part_alignment::SurveyPicture>& pictures);

/// The list `scale_bars` of a file, of PART.json too: other keys are not looked at.
/// Errors (kInput): no such list; a bar that has none of its four keys or a number out of range.
[[nodiscard]] Result<std::vector<part_alignment::ScaleBar>> ReadScaleBarFile(
    const std::filesystem::path& path);

}  // namespace trammel::files
