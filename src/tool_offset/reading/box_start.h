// Between a rectangle that was seen on the small page and the box's lines at full resolution.
#pragma once

#include <optional>
#include <vector>

#include "tool_offset/reading/box_candidates.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/reading/small_page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// How far apart a scanner's two axes may be in scale.
inline constexpr double kAnisotropy = 0.04;
/// The same of a picture seen from aslant, by 40 degrees, or squeezed, as a fax is.
inline constexpr double kSlantedAnisotropy = 0.28;
/// A part of each side where the box's lines must be found.
inline constexpr double kSideFound = 0.6;

/// Strength that only ink and edges have: the 99.7 % point, or what stands out of noise.
[[nodiscard]] int InkStrength(const SmallPage& small);

/// Weights that give the ink along the candidate's sides the value 1 above the paper.
[[nodiscard]] ChannelMix MixOfSides(const SmallPage& small, const BoxCandidate& candidate,
                                    int threshold);

/// The map that lays the sheet's u axis along side `side` of the candidate.
[[nodiscard]] std::optional<PageMap> StartMap(const SmallPage& small, const BoxCandidate& candidate,
                                              std::size_t side, const SheetPlan& plan);

/// The same lines with the axes the other way round.
[[nodiscard]] PageMap Turned(const PageMap& map, bool flip_u, bool flip_v);

/// The places on the sides of such a turned map.
[[nodiscard]] std::vector<SidePoint> Turned(std::vector<SidePoint> places, bool flip_u,
                                            bool flip_v);

/// Fills in how the sheet lies on the page, from its map.
void DescribeTurn(SheetOnPage& sheet);

}  // namespace trammel::tool_offset
