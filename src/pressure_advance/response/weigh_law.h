// The crossings of lines and the law that their profiles show, weighed against each other.
#pragma once

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/response/combine_transitions.h"
#include "pressure_advance/response/law_fit.h"

namespace trammel::pressure_advance {

/// How much a law counts by what it leaves over of the lines: 1 up to trusted_misfit, falling to 0
/// at refuted_misfit.
[[nodiscard]] double TrustIn(const LawFit& law, const LawOptions& options);

/// Takes out of the crossings what the same fit errs by on lines that the learnt law lays, and
/// weighs the result with the law's own value by their variances; the law's own error is in both.
/// Both count by the trust in the law, and a part of what it moves the answer by stays open. Where
/// the two, or the transitions after that, differ by more than twice what is known of them
/// explains, the rest enters as a rectangular distribution, with a notice.
/// @returns what each of the two says and by how much it counts; without lines
/// @param twin  of the mirrored lines: their scatter, and what the law does to the
///   fit, are the same
/// REQUIRES whole, first and second in both.
LearntLaw WeighWithLaw(const LawFit& law, const CombinedTransitions& twin,
                       const LawOptions& options, CombinedTransitions& crossings);

}  // namespace trammel::pressure_advance
