// What a pattern will look like on the bed, before it is printed.
#pragma once

#include "document/canvas.h"
#include "pressure_advance/pattern/pattern.h"

namespace trammel::report {

/// Two views: the whole bed with every pattern and travel, and the first pattern close up with
/// beads at their true width, coloured by speed, each line's pressure advance, start and
/// dimensions. Write it with ToSvg() or ToPng().
/// REQUIRES a layout made from this config, with at least one line.
[[nodiscard]] Canvas PatternPreview(const pressure_advance::PatternLayout& layout,
                                    const pressure_advance::PatternConfig& config);

}  // namespace trammel::report
