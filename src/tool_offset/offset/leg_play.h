// Play of the axes on sheets whose fingers are drawn there and back.
#pragma once

#include <optional>
#include <vector>

#include "base/measured.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

struct PlayOfLegs {
  std::optional<Quantity> x_mm;  ///< of the bed's axes; nothing where the sheet does not tell
  std::optional<Quantity> y_mm;
};

/// Play from the distance of fingers' two legs.
///
/// The middle of a finger that is drawn there and back has no play in it, but its legs lag opposite
/// ways: combs that are stepped one way have their legs closer together, the others further apart.
/// What a tool's lines do to the distance by their shape is the same in all its combs of an axis,
/// and is fitted with the play: least squares, each comb weighted by the scatter of its tool's
/// distances; intervals widen where combs contradict each other (chi-square, 1 %).
/// @param structures  with their fingers, of this plan.
[[nodiscard]] PlayOfLegs EstimatePlayOfLegs(const SheetPlan& plan,
                                            const std::vector<StructureReading>& structures);

}  // namespace trammel::tool_offset
