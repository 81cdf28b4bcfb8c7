// Several photos of one print.
#pragma once

#include <span>

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Answers from all photos of one print together: seen from several places, lines of another height
/// or colour show themselves (SheetModel).
/// @param photos  of the same print and plan, with the same camera; at least one. Each was read
/// with
///                as a photo.
/// @returns the first one's reading, with everybody's answers.
[[nodiscard]] SheetResult JoinPhotos(const SheetPlan& plan, std::span<const SheetResult> photos);

}  // namespace trammel::tool_offset
