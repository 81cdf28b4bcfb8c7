// Rejects plain targets whose rays meet although no target is there.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/survey/plain_matching.h"

namespace trammel::part_alignment {

/// Drops targets that several pictures show close beside their place, where no other target appears
/// together with them: a small motion, or a reflection, which wanders with the camera. Also drops
/// pairs of which one ends before the other begins (a target put elsewhere).
void DropDoubtful(const std::vector<PlainView>& views, PlainMatches& matches);

/// Misfit between the outlines of a place's sights and the one disc that fits them best.
struct ShapeFit {
  double misfit_px = 0;  ///< rms, of an axis
  int freedom = 0;
  std::size_t worst = 0;  ///< index of the match's worst member
};
/// Absent with fewer than three outlines.
[[nodiscard]] std::optional<ShapeFit> FitShape(const std::vector<PlainView>& views,
                                               const PlainMatch& match);

/// Drops targets whose outlines differ from a round disc's by more than most targets' do:
/// reflections, and two discs merged in some views. A few bad outlines do not drop a target whose
/// others fit.
void DropByShape(const std::vector<PlainView>& views, PlainMatches& matches);

}  // namespace trammel::part_alignment
