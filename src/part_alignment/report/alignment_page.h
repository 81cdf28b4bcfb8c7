// The page of an alignment.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "document/figure.h"
#include "part_alignment/report/alignment_json.h"

namespace trammel::report {

/// "plan": the whole scene from above with the work offset. Nothing unless the verdict is good.
[[nodiscard]] std::optional<Figure> AlignmentPlanFigure(const AlignmentOutput& output);

/// Where the part is, the lines for each control, the scene, what the uncertainty is made of, its
/// covariance and the residuals. Stands alone; text from outside may hold any bytes.
/// @param views  of AlignmentPicture: those that the page is to show.
[[nodiscard]] std::string AlignmentPage(const AlignmentOutput& output,
                                        std::span<const Figure> views);

}  // namespace trammel::report
