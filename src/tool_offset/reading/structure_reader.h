// Reads the structures of a sheet: fingers, then the displacement of comb 1 against comb 0.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Prior knowledge of a comb before it is read.
struct CombExpectation {
  ChannelMix mix{};  ///< scaled: ink is about 1 above its paper
  SheetPoint shift;  ///< tool's coarse shift from the plan; excludes a programmed one
  std::string tool;  ///< "T1", for reasons
};

/// Computes the offset above which the teeth of two combs touch, minus a margin for blur.
[[nodiscard]] double FineReach_mm(const SheetSettings& settings);

/// Reads every finger of both combs.
///
/// First locates each finger where it is isolated. A robust line through a comb's fingers then
/// predicts each place, and the finger is read there. Broken, blotted, merged or missing fingers
/// are skipped, each with its reason.
/// @param foreign  lines of other tools that may cross fingers: those are skipped.
/// @returns the fingers of comb 0, then of comb 1. Errors (kMeasurement) name the tool: more than
/// half of a comb is missing; its lines run together.
[[nodiscard]] Result<std::vector<FingerReading>> ReadStructure(
    const PageView& page, const PageMap& map, const SheetPlan& plan, const Structure& structure,
    const std::array<CombExpectation, 2>& expected, std::span<const ForeignLeg> foreign);

/// Fits all fingers of both combs by least squares: a smooth part that both share (the paper's
/// wrinkles, its stretch and the scan's, all that bends the page) and one displacement of comb 1.
///
/// The combs alternate, so anything smooth over two pitches does not affect the displacement; the
/// polynomials follow wrinkles down to 40 mm. Fingers far off are rejected one by one; those
/// already marked remain rejected. Assumes that fingers err independently (their two legs need not)
/// and, of one comb, by as much. In a photo (its lever is set) the displacement may grow along the
/// axis, too: lines of another height appear in another scale.
/// @param structure  its fingers are set; everything else is filled in. With fewer than 4 fingers
/// of a comb it remains refused.
/// Accuracy: with 17 teeth the offset has 1.03 times the uncertainty of the difference of two means
/// (structure_reader_test).
void FitCombs(const SheetSettings& settings, StructureReading& structure);

}  // namespace trammel::tool_offset
