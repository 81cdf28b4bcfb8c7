// Plain targets whose rays meet although no target is there.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/survey/plain_matching.h"

namespace trammel::part_alignment {

/// Leaves out targets that several pictures show close beside their place, where nothing else
/// stands that is seen together with them (a small motion; a reflection, which wanders with the
/// camera), and pairs of which one ends
/// before the other begins (a target put elsewhere).
void DropDoubtful(const std::vector<PlainView>& views, PlainMatches& matches);

/// The outlines of a place's sights against those of the one disc that fits them best.
struct ShapeFit {
  double misfit_px = 0;  ///< rms, of an axis
  int freedom = 0;
  std::size_t worst = 0;  ///< of the match's members, the one that differs most
};
/// Absent with fewer than three outlines.
[[nodiscard]] std::optional<ShapeFit> FitShape(const std::vector<PlainView>& views,
                                               const PlainMatch& match);

/// Leaves out targets whose outlines differ by more from those of a round disc than most targets'
/// do: reflections, and what views make of two discs. A few outlines that are no such disc's, of
/// one whose others are, leave it alone.
void DropByShape(const std::vector<PlainView>& views, PlainMatches& matches);

}  // namespace trammel::part_alignment
