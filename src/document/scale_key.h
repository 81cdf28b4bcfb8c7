// How long a drawn arrow of a round value is: the scale of residuals that are drawn enlarged.
#pragma once

#include <string>

#include "document/canvas.h"

namespace trammel::report {

/// 1, 2 or 5 times a power of ten: the largest that does not exceed `most`.
/// REQUIRES `most` finite and > 0.
[[nodiscard]] double RoundedDown(double most);

/// A bar as long as a round value is drawn, and that value behind it: "0.02 px". Clear of text
/// whose baseline is `at`.
/// @param at           left end, on the text's baseline
/// @param px_per_unit  px of the canvas per unit of the value, finite and > 0
/// @param most_px      that the bar may be long
/// @return  the right end of the text
double DrawScaleKey(Canvas& canvas, const PointPx& at, double px_per_unit, double most_px,
                    const std::string& unit, const Stroke& stroke);

}  // namespace trammel::report
