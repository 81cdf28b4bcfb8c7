// What the figures of a scanned sheet share.
#pragma once

#include <string>
#include <string_view>

#include "base/measured.h"
#include "document/canvas.h"
#include "document/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::report {

/// Comb 0 and comb 1, told apart by lightness, too.
inline constexpr Color kCombColors[] = {kBlue, kVermilion};

/// A line that can be seen on ink and on paper alike.
void HaloLine(Canvas& canvas, std::span<const PointPx> points, const Stroke& stroke);

/// Text on a patch of paper; its angle counts, its alignment is the middle.
void TagText(Canvas& canvas, const PointPx& middle, std::string_view text, const TextStyle& style);

/// A small x.
void Cross(Canvas& canvas, const PointPx& middle, double half_px, const Stroke& stroke);

/// "T1", "T1 after 2 pick-ups".
[[nodiscard]] std::string CombName(const tool_offset::Comb& comb);

/// "+0.3123 mm (95 %: +0.3102 to +0.3144 mm)", or the verdict.
[[nodiscard]] std::string OffsetWords(const Measured& measured);

}  // namespace trammel::report
