// All fingers of one structure on the scan.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "tool_offset/reading/foreign_ink.h"
#include "tool_offset/reading/ink_channel.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// What is known of a comb before it is read.
struct CombExpectation {
  ChannelMix mix{};  ///< its ink is about 1 above its paper
  SheetPoint shift;  ///< of the tool against the plan, as read coarsely; without a programmed one
  std::string tool;  ///< "T1", for reasons
};

/// Beyond this the teeth of two combs begin to touch, less a margin for blur.
[[nodiscard]] double FineReach_mm(const SheetSettings& settings);

/// Reads every finger of both combs.
///
/// First each finger is looked for where it stands alone, then a robust line through a comb's
/// fingers says where each must be, and there it is read. Fingers that are broken, blotted, merged
/// or missing are left out, each with its reason.
/// @param foreign  lines of other tools that may lie across fingers: those are left out.
/// @returns the fingers of comb 0, then of comb 1. Errors (kMeasurement) name the tool: more than
///          half of a comb is missing; its lines run together.
[[nodiscard]] Result<std::vector<FingerReading>> ReadStructure(
    const PageView& page, const PageMap& map, const SheetPlan& plan, const Structure& structure,
    const std::array<CombExpectation, 2>& expected, std::span<const ForeignLeg> foreign);

}  // namespace trammel::tool_offset
