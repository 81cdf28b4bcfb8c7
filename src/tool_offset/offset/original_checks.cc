#include "tool_offset/offset/original_checks.h"

#include <fmt/format.h>

#include <cmath>

#include "tool_offset/offset/sheet_model.h"

namespace trammel::tool_offset {

std::optional<std::string> CheckAgainstFile(const SheetPlan& plan, const SheetResult& result) {
  constexpr double kMostBias_mm = 0.03;  // of the published method
  constexpr double kSigmas = 4;
  // A pair's "+" and "-" structure stand one after the other.
  for (std::size_t i = 0; i + 1 < plan.structures.size(); i += 2) {
    const Structure& plus = plan.structures[i];
    if (plus.combs[0].tool != plan.settings.reference_tool) continue;
    const Measured& first = result.structures[i].offset_mm;
    const Measured& second = result.structures[i + 1].offset_mm;
    if (!first.good() || !second.good()) continue;
    // The tested comb is comb 0 of "+" and comb 1 of "-": what favours an order cancels.
    const double programmed_mm = -Programmed_mm(plus);
    const double offset_mm = (second.quantity().value - first.quantity().value) / 2;
    const double uncertainty_mm =
        std::hypot(first.quantity().standard_uncertainty, second.quantity().standard_uncertainty) /
        2;
    if (std::abs(offset_mm - programmed_mm) < kMostBias_mm + kSigmas * uncertainty_mm) continue;
    return fmt::format(
        "T{} against itself is moved by {:+.3f} mm along {} on the sheet, by {:+.3f} mm in the "
        "file: the sheet was not printed from this file, so that its other offsets do not count "
        "either. Give the G-code that was printed",
        plan.settings.reference_tool, offset_mm, plus.axis == Axis::kX ? 'u' : 'v', programmed_mm);
  }
  return std::nullopt;
}

}  // namespace trammel::tool_offset
