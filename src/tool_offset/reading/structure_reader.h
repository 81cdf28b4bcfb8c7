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

/// Fits all fingers of both combs by least squares: a smooth part that both share (the paper's
/// wrinkles, its stretch and the scan's, whatever bends the page) and one displacement of comb 1.
///
/// The combs alternate, so that what is smooth over two pitches leaves the displacement alone; the
/// polynomials follow wrinkles down to 40 mm. Fingers far off are left out one by one, those
/// already marked stay out. Assumes that fingers err independently (their two legs need not) and,
/// of one comb, by as much.
/// Of a photo (its lever is set) the displacement may grow along the axis, too: lines of another
/// height are seen in another scale.
/// @param structure  its fingers are set; everything else is filled in. Fewer than 4 fingers of a
/// comb
///                   leave it refused.
/// Accuracy: with 17 teeth the offset has 1.03 times the uncertainty of the difference of two means
///           (structure_reader_test).
void FitCombs(const SheetSettings& settings, StructureReading& structure);

}  // namespace trammel::tool_offset
