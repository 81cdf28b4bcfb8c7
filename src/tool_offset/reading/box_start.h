// Lays the sheet on a rectangle: scale, side and turn.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/box_candidates.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/reading/sheet_finder.h"
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

/// Looks across the sides of a box for the distance after which its lines repeat.
/// @param mix         ink is higher than paper.
/// @param corners     of the box, in order, page pixels; right to `slack_px`.
/// @param lowest_px, highest_px  the range of distances to look in.
/// @returns nothing where no lines repeat.
/// Accuracy: about 1 % (sheet_finder_test reads codes with it, which need 1 %).
[[nodiscard]] std::optional<double> LineSpacing_px(const PageView& page, const ChannelMix& mix,
                                                   const std::array<PagePoint, 4>& corners,
                                                   double slack_px, double lowest_px,
                                                   double highest_px);

/// The box as a scan shows it: one bar of three lines that have run together.
[[nodiscard]] SheetPlan BarOf(const SheetPlan& plan);

/// Compares the ink where the reference tool's combs stand alone with the paper between them, each
/// beyond the reach of the tested combs. About 1 the right way round, 0 elsewhere.
/// @param mix  ink is about 1 above its paper.
[[nodiscard]] double ReferenceMatch(const PageView& page, const SheetPlan& plan,
                                    const ChannelMix& mix, const PageMap& map);

}  // namespace trammel::tool_offset
