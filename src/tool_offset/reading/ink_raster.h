// Ink of the whole sheet as a raster, its colours, and lines of other tools on it.
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

/// How far each cell's colour is from the paper around it, and around the box as far as tools may
/// print.
struct InkRaster {
  double low_u_mm = 0;  ///< of the first cell's middle
  double low_v_mm = 0;
  int columns = 0;                     ///< along u
  int rows = 0;                        ///< along v
  std::vector<std::uint8_t> strength;  ///< 0 … 255 levels, row by row
  std::vector<std::uint8_t> on_page;   ///< 0 for cells beside the page, else 1
  double noise = 1;                    ///< of the paper, 1 sigma, in levels

  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  /// What ink differs from paper by at least, in levels.
  [[nodiscard]] double FaintestInk() const;
  [[nodiscard]] int Column(double u_mm) const;  ///< nearest; may lie beside the raster
  [[nodiscard]] int Row(double v_mm) const;
};

/// Samples the page.
/// @param around_mm  how far beside the box the raster reaches, >= 0.
/// Cost: one sample per cell and channel, on all processors.
[[nodiscard]] InkRaster TakeInkRaster(const PageView& page, const PageMap& map, double around_mm);

/// Median along the middles of legs, in levels; 0 where none lies in the raster. What differs from
/// the paper far around, also where no paper is left beside a leg.
[[nodiscard]] double MedianStrength(const InkRaster& raster, std::span<const Leg> legs);

/// Marks the cells within `half_mm` of a leg's middle line, and of its ends.
void PaintLeg(const InkRaster& raster, const Leg& leg, double half_mm,
              std::vector<std::uint8_t>& mask);

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

/// A line of a tool so far off that it may lie in a structure that is not its own.
struct ForeignLeg {
  int tool = 0;
  Leg leg;  ///< where it is
};

/// The lines of all tools that are further off than `near_mm`.
/// @param shift  of each tool that was found, on the sheet.
[[nodiscard]] std::vector<ForeignLeg> ForeignLegs(const SheetPlan& plan,
                                                  const std::map<int, SheetPoint>& shift,
                                                  double near_mm);

/// Whether a foreign line comes nearer than `clear_mm` to a finger, and whose; -1 where none does.
/// @param low, high  corners of the finger, on the sheet.
[[nodiscard]] int ForeignTool(std::span<const ForeignLeg> legs, SheetPoint low, SheetPoint high,
                              double clear_mm);

/// For each structure the part of its white that holds ink which belongs to no line of the sheet.
/// @param shift         of each tool that was found, the reference tool included.
/// @param ink_strength  of the reference tool, in levels.
[[nodiscard]] std::vector<double> StrayInk(const InkRaster& raster, const SheetPlan& plan,
                                           const std::map<int, SheetPoint>& shift,
                                           double ink_strength);

}  // namespace trammel::tool_offset
