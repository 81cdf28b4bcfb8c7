// Raster of the whole sheet's ink, its colours, and lines of other tools on it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Side of a cell: a line of 0.4 mm is four cells wide.
inline constexpr double kInkCell_mm = 0.1;

/// Difference of each cell's colour from the paper around it, and around the box as far as tools
/// may print.
struct InkRaster {
  double low_u_mm = 0;  ///< centre of the first cell
  double low_v_mm = 0;
  int columns = 0;                     ///< along u
  int rows = 0;                        ///< along v
  std::vector<std::uint8_t> strength;  ///< 0 … 255 levels, row by row
  std::vector<std::uint8_t> on_page;   ///< 0 for cells beside the page, else 1
  double noise = 1;                    ///< paper noise, 1 sigma, in levels

  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  /// Returns the least difference of ink from paper, in levels.
  [[nodiscard]] double FaintestInk() const;
  [[nodiscard]] int Column(double u_mm) const;  ///< nearest; may lie beside the raster
  [[nodiscard]] int Row(double v_mm) const;
};

/// Samples the page.
/// @param around_mm  margin of the raster beside the box, >= 0.
/// Cost: one sample per cell and channel, on all processors.
[[nodiscard]] InkRaster TakeInkRaster(const PageView& page, const PageMap& map, double around_mm);

/// Computes the median along the middles of legs, in levels; 0 if none is in the raster. Measured
/// against the paper far around, so it is valid without paper beside a leg.
[[nodiscard]] double MedianStrength(const InkRaster& raster, std::span<const Leg> legs);

/// Marks the cells within `half_mm` of a leg's middle line, and of its ends.
void PaintLeg(const InkRaster& raster, const Leg& leg, double half_mm,
              std::vector<std::uint8_t>& mask);

/// Channels blue, green, red, and their luma. A grey page has the first only.
inline constexpr std::size_t kInkChannels = 4;
[[nodiscard]] std::string_view InkChannelName(std::size_t channel, int page_channels);
[[nodiscard]] ChannelMix InkChannelMix(std::size_t channel);

/// Contrast of a tool's ink to the paper beside it, in each channel. Levels 0 … 255.
struct InkColour {
  std::array<double, kInkChannels> contrast{};  ///< ink minus paper; negative for darker ink
  std::array<double, kInkChannels> noise{};     ///< paper noise, standard deviation, >= 0.5
  std::size_t channels = 0;                     ///< 1 or kInkChannels

  /// Returns the channel with the best ratio of contrast to noise.
  [[nodiscard]] std::size_t best() const;
  /// Returns the channel's contrast over its noise.
  [[nodiscard]] double signal(std::size_t channel) const;
};

/// Samples along the middles of legs, and on the paper half a leg spacing to either side.
/// @param legs   at their actual positions.
/// @param map    to the page.
[[nodiscard]] InkColour SampleInk(const PageView& page, const PageMap& map,
                                  const SheetSettings& settings, std::span<const Leg> legs);

/// Returns the absolute contrast of the strongest channel; levels.
[[nodiscard]] double Strength(const InkColour& ink);

/// True if ink is readable: 8 levels, and 3 times the paper's noise.
[[nodiscard]] bool IsReadable(const InkColour& ink);

/// Explains why unreadable ink is so.
/// @param around  its difference from the paper far around (MedianStrength), levels.
[[nodiscard]] std::string WhyUnreadable(const InkColour& ink, double around);

/// Channels and mixes for two combs that belong together.
struct ChannelChoice {
  std::array<std::size_t, 2> channel{};
  std::array<ChannelMix, 2> mix{};  ///< each tool's ink is 1 above its paper
};

/// Selects one channel for both if both are clear in it: a scanner's colours are not exactly
/// aligned. Otherwise each one's best.
[[nodiscard]] ChannelChoice ChooseChannels(const InkColour& first, const InkColour& second);

/// Line of a tool so far off that it may be in another tool's structure.
struct ForeignLeg {
  int tool = 0;
  Leg leg;  ///< its place
};

/// Returns the lines of all tools that are farther off than `near_mm`.
/// @param shift  of each tool that was found, on the sheet.
[[nodiscard]] std::vector<ForeignLeg> ForeignLegs(const SheetPlan& plan,
                                                  const std::map<int, SheetPoint>& shift,
                                                  double near_mm);

/// Returns the tool whose line comes nearer than `clear_mm` to a finger; -1 without one.
/// @param low, high  corners of the finger, on the sheet.
[[nodiscard]] int ForeignTool(std::span<const ForeignLeg> legs, SheetPoint low, SheetPoint high,
                              double clear_mm);

/// Returns, per structure, the part of its white with ink that belongs to no line of the sheet.
/// @param shift         of each tool that was found, the reference tool included.
/// @param ink_strength  of the reference tool, in levels.
[[nodiscard]] std::vector<double> StrayInk(const InkRaster& raster, const SheetPlan& plan,
                                           const std::map<int, SheetPoint>& shift,
                                           double ink_strength);

}  // namespace trammel::tool_offset
