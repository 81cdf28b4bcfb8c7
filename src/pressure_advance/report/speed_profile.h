// The commanded speed along a line, for pictures.
#pragma once

#include <vector>

#include "document/plot.h"
#include "pressure_advance/profile/line_motion.h"

namespace trammel::report {

/// Speed in mm/s over position, in mm or (in_mm = false) in line lengths. With length and
/// acceleration known, changes of speed take their way inside the faster segment; else they are
/// steps. Empty where the motion does not say enough.
[[nodiscard]] std::vector<DataPoint> SpeedAlongLine(const pressure_advance::LineMotion& motion,
                                                    bool in_mm);

}  // namespace trammel::report
