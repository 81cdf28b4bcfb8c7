// Finds the sheet of the method's original generator on a scanned page.
#pragma once

#include "base/result.h"
#include "tool_offset/reading/sheet_finder.h"

namespace trammel::tool_offset {

/// Finds the box, one bar of three lines that run together, and how it is turned.
///
/// Nothing on the sheet is there to say which way round it lies: of the eight ways (the box's sides
/// leave four or eight) the one counts in which the reference tool's combs lie on ink and paper
/// lies between them, each beside the tested combs' reach, so that no offset of another tool
/// matters. A mirrored page is read as it was drawn: everything is measured in the print's own
/// axes. Fails, with what to do about it, where there is no box or only a part of one, more than
/// one sheet, or where no way round stands out: another sheet, or lines that are missing.
/// @param plan  of an original sheet.
[[nodiscard]] Result<SheetOnPage> FindOriginalSheet(const PageView& page, const SheetPlan& plan);

}  // namespace trammel::tool_offset
