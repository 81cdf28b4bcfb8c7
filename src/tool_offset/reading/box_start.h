// Fits the sheet to a rectangle: scale, side and rotation.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/box_candidates.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Largest difference in scale of a scanner's two axes.
inline constexpr double kAnisotropy = 0.04;
/// Anisotropy limit of an oblique view, by 40 degrees, or of a squeezed picture, as a fax.
inline constexpr double kSlantedAnisotropy = 0.28;
/// Minimum share of each side on which the box's lines must be found.
inline constexpr double kSideFound = 0.6;

/// Computes the strength that only ink and edges have: the 99.7 % point, or the level above noise.
[[nodiscard]] int InkStrength(const SmallPage& small);

/// Computes weights by which the ink along the candidate's sides is 1 above the paper.
[[nodiscard]] ChannelMix MixOfSides(const SmallPage& small, const BoxCandidate& candidate,
                                    int threshold);

/// Computes the map whose u axis runs along side `side` of the candidate.
[[nodiscard]] std::optional<PageMap> StartMap(const SmallPage& small, const BoxCandidate& candidate,
                                              std::size_t side, const SheetPlan& plan);

/// Returns the map of the same lines with reversed axes.
[[nodiscard]] PageMap Turned(const PageMap& map, bool flip_u, bool flip_v);

/// Converts points on the sides to such a reversed map.
[[nodiscard]] std::vector<SidePoint> Turned(std::vector<SidePoint> places, bool flip_u,
                                            bool flip_v);

/// Measures across the sides of a box the distance at which its lines repeat.
/// @param mix         ink is higher than paper.
/// @param corners     of the box, in order, page pixels; right to `slack_px`.
/// @param lowest_px, highest_px  the range of distances to search.
/// @returns nothing if no lines repeat.
/// Accuracy: about 1 % (sheet_finder_test reads codes with it, which need 1 %).
[[nodiscard]] std::optional<double> LineSpacing_px(const PageView& page, const ChannelMix& mix,
                                                   const std::array<PagePoint, 4>& corners,
                                                   double slack_px, double lowest_px,
                                                   double highest_px);

/// Returns the plan with the box as one bar of three merged lines, as a scan shows it.
[[nodiscard]] SheetPlan BarOf(const SheetPlan& plan);

/// Compares the ink on the reference tool's isolated combs with the paper between them, each beyond
/// the reach of the tested combs. About 1 in the right orientation, 0 otherwise.
/// @param mix  ink is about 1 above its paper.
[[nodiscard]] double ReferenceMatch(const PageView& page, const SheetPlan& plan,
                                    const ChannelMix& mix, const PageMap& map);

}  // namespace trammel::tool_offset
