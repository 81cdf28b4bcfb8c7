// Decomposes a tap into straight lines, as published.
#pragma once

#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"
#include "tap/two_line/tap_lines.h"

namespace trammel::tap {

/// Computes the height at which decompression and departure cross.
///
/// The uncertainty is from the scatter about the two lines. It does not include the form of the
/// press: if the press stiffens or softens, the crossing is off by microns that no scatter shows
/// (docs/howto/tap.md has figures). The contact method exists for that.
/// @param lines   Of clean, found with the same motion.
/// @param result  Verdict, reason, contact, uncertainty, noise and points are set; a skipped split
/// adds a notice.
void JudgeTwoLine(std::span<const Move> moves, const CleanTap& clean, const TapMotion& motion,
                  const TapLines& lines, const TapOptions& options, TapAnalysis& result);

/// Sets the corners that were found in the force curve, as crossings of lines.
void SetPoints(const CleanTap& clean, const TapMotion& motion, const TapLines& lines,
               TapAnalysis& result);

}  // namespace trammel::tap
