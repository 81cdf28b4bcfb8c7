// Writes pages of targets to print, to scale.
#pragma once

#include <string>

#include "base/page.h"
#include "part_alignment/targets/target_sheet.h"

namespace trammel::report {

/// Returns all pages, at a scale of 1:1: print without fitting to the page, and check the scale
/// bar. REQUIRES a sheet of PlanTargetSheet.
[[nodiscard]] std::string TargetPagesPdf(const part_alignment::TargetSheet& sheet);

/// Returns one page, counted from 0.
[[nodiscard]] std::string TargetPageSvg(const part_alignment::TargetSheet& sheet, int page);

/// Returns one page as grey pixels (1 channel). REQUIRES px_per_mm in (0, 100] and a picture of at
/// most 30,000 px a side.
[[nodiscard]] Page TargetPageImage(const part_alignment::TargetSheet& sheet, int page,
                                   double px_per_mm);

}  // namespace trammel::report
