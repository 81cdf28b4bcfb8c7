// In which colour channel a tool's ink is read best.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Blue, green, red, and their sum as the eye weighs it. A grey page has the first only.
inline constexpr std::size_t kInkChannels = 4;
[[nodiscard]] std::string_view InkChannelName(std::size_t channel, int page_channels);
[[nodiscard]] ChannelMix InkChannelMix(std::size_t channel);

/// A tool's ink against the paper beside it, in each channel. Levels 0 … 255.
struct InkColour {
  std::array<double, kInkChannels> contrast{};  ///< ink minus paper; negative for darker ink
  std::array<double, kInkChannels> noise{};     ///< of the paper, standard deviation, >= 0.5
  std::size_t channels = 0;                     ///< 1 or kInkChannels

  /// The channel with the best contrast against noise.
  [[nodiscard]] std::size_t best() const;
  /// Its contrast over its noise.
  [[nodiscard]] double signal(std::size_t channel) const;
};

/// Looks along the middles of legs, and half a leg spacing to either side of them, where paper is.
/// @param legs   where they really are.
/// @param map    to the page.
[[nodiscard]] InkColour SampleInk(const PageView& page, const PageMap& map,
                                  const SheetSettings& settings, std::span<const Leg> legs);

/// The contrast of the channel that shows it most, without sign; levels.
[[nodiscard]] double Strength(const InkColour& ink);

/// Whether ink can be read at all: 8 levels, and 3 times the paper's noise.
[[nodiscard]] bool IsReadable(const InkColour& ink);

/// Why ink that cannot be read cannot.
/// @param around  how much it differs from the paper far around (MedianStrength), levels.
[[nodiscard]] std::string WhyUnreadable(const InkColour& ink, double around);

/// How two combs that belong together are read.
struct ChannelChoice {
  std::array<std::size_t, 2> channel{};
  std::array<ChannelMix, 2> mix{};  ///< each tool's ink is 1 above its paper
};

/// One channel for both where both are clear in one: a scanner's colours do not lie exactly upon
/// each other. Otherwise each in its best.
[[nodiscard]] ChannelChoice ChooseChannels(const InkColour& first, const InkColour& second);

}  // namespace trammel::tool_offset
