// One structure: by how much comb 1 is displaced against comb 0.
#pragma once

#include <vector>

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

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
///           (comb_fit_test).
void FitCombs(const SheetSettings& settings, StructureReading& structure);

}  // namespace trammel::tool_offset
