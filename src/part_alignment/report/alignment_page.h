// The page of an alignment.
#pragma once

#include <span>
#include <string>

#include "document/figure.h"
#include "part_alignment/report/alignment_json.h"

namespace trammel::report {

/// Where the part is, the lines for each control, what the uncertainty is made of, and all
/// in words. result.json has covariance and residuals. Stands alone; text from outside may hold any
/// bytes.
/// @param views  of AlignmentPicture: those that the page is to show.
[[nodiscard]] std::string AlignmentPage(const AlignmentOutput& output,
                                        std::span<const Figure> views);

}  // namespace trammel::report
