// Writes a part fit and an uncertainty budget as JSON and text, the fit's page and its figure.
#pragma once

#include <span>
#include <string>

#include "document/figure.h"
#include "part_alignment/budget/budget.h"
#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

/// Returns one object (docs/reference/formats.md), ended by a newline. Values that need verdict
/// good are null otherwise.
[[nodiscard]] std::string ToJson(const part_alignment::PartFitInput& input,
                                 const part_alignment::PartFit& fit);
[[nodiscard]] std::string ToJson(const part_alignment::Budget& budget);

/// Several lines.
[[nodiscard]] std::string PartFitText(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit);
[[nodiscard]] std::string BudgetText(const part_alignment::Budget& budget);

/// "stock-allowance": every point with its surplus over what is wanted, on the side of the part
/// that its surface faces there; sides without points are left out. What the placement rests on is
/// named. REQUIRES stock allowances of this input.
[[nodiscard]] Figure StockAllowanceFigure(const part_alignment::PartFitInput& input,
                                          const part_alignment::PartFit& fit);

/// Returns self-contained HTML.
[[nodiscard]] std::string PartFitPage(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit,
                                      std::span<const Figure> figures);

}  // namespace trammel::report
