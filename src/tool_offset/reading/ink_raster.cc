#include "tool_offset/reading/ink_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/statistics.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::tool_offset {
namespace {

/// Cells per side of a tile: 3.2 mm, in which the map is linear to a micron, and the paper's light
/// is uniform.
constexpr int kTile = 32;
/// Tiles to each side whose cells determine the paper's level: wider than a structure, whose ink
/// covers less than half.
constexpr int kAround = 2;

/// Levels of all channels, in tiles.
struct Levels {
  int tile_columns = 0;
  int tile_rows = 0;
  std::size_t channels = 1;
  std::vector<std::uint8_t> value;       ///< by cell, then by channel
  std::vector<std::uint16_t> histogram;  ///< by tile, channel, level
};

void SampleTile(const PageView& page, const PageMap& map, int tile_column, int tile_row,
                InkRaster& raster, Levels& levels) {
  const int first_column = tile_column * kTile;
  const int first_row = tile_row * kTile;
  const int last_column = std::min(first_column + kTile, raster.columns);
  const int last_row = std::min(first_row + kTile, raster.rows);
  const double u_mm = raster.low_u_mm + (first_column + kTile / 2) * kInkCell_mm;
  const double v_mm = raster.low_v_mm + (first_row + kTile / 2) * kInkCell_mm;
  const LocalMap local = map.Near({u_mm, v_mm});
  const std::size_t tile = static_cast<std::size_t>(tile_row * levels.tile_columns + tile_column);
  for (int row = first_row; row < last_row; ++row) {
    for (int column = first_column; column < last_column; ++column) {
      const PagePoint at = local.ToPage({(column - first_column - kTile / 2) * kInkCell_mm,
                                         (row - first_row - kTile / 2) * kInkCell_mm});
      // Also false for NaN.
      if (!(at.x_px >= 0 && at.y_px >= 0 && at.x_px < page.width - 1 &&
            at.y_px < page.height - 1)) {
        continue;
      }
      const int x = static_cast<int>(at.x_px);
      const int y = static_cast<int>(at.y_px);
      const auto fx = static_cast<float>(at.x_px - x);
      const auto fy = static_cast<float>(at.y_px - y);
      const std::size_t cell = raster.at(column, row);
      raster.on_page[cell] = 1;
      const std::uint8_t* upper = page.row(y) + std::ptrdiff_t{page.channels} * x;
      const std::uint8_t* lower = upper + page.stride;
      for (std::size_t c = 0; c < levels.channels; ++c) {
        const std::size_t next = c + levels.channels;
        const float top =
            static_cast<float>(upper[c]) * (1 - fx) + static_cast<float>(upper[next]) * fx;
        const float bottom =
            static_cast<float>(lower[c]) * (1 - fx) + static_cast<float>(lower[next]) * fx;
        const auto level = static_cast<std::uint8_t>(top + fy * (bottom - top) + 0.5F);
        levels.value[cell * levels.channels + c] = level;
        ++levels.histogram[(tile * levels.channels + c) * 256 + level];
      }
    }
  }
}

/// Returns the most frequent level of the tiles around one: paper. Smoothed over a few levels of
/// noise.
int PaperLevel(const Levels& levels, int tile_column, int tile_row, std::size_t channel) {
  constexpr int kSmooth = 3;
  std::array<std::uint32_t, 256 + 2 * kSmooth + 1> sum{};  // counts of all lower levels
  for (int row = std::max(0, tile_row - kAround);
       row <= std::min(levels.tile_rows - 1, tile_row + kAround); ++row) {
    for (int column = std::max(0, tile_column - kAround);
         column <= std::min(levels.tile_columns - 1, tile_column + kAround); ++column) {
      const std::size_t tile = static_cast<std::size_t>(row * levels.tile_columns + column);
      const std::uint16_t* histogram =
          levels.histogram.data() + (tile * levels.channels + channel) * 256;
      for (std::size_t level = 0; level < 256; ++level) {
        sum[level + kSmooth + 1] += histogram[level];
      }
    }
  }
  for (std::size_t i = 1; i < sum.size(); ++i) sum[i] += sum[i - 1];
  int best = 0;
  std::uint32_t most = 0;
  for (int level = 0; level < 256; ++level) {
    const std::uint32_t count =
        sum[static_cast<std::size_t>(std::min(256 + kSmooth, level + 2 * kSmooth + 1))] -
        sum[static_cast<std::size_t>(level)];
    if (count <= most) continue;
    most = count;
    best = level;
  }
  return best;
}

void CompareTile(const Levels& levels, int tile_column, int tile_row, InkRaster& raster) {
  std::array<int, 3> paper{};
  for (std::size_t c = 0; c < levels.channels; ++c) {
    paper[c] = PaperLevel(levels, tile_column, tile_row, c);
  }
  for (int row = tile_row * kTile; row < std::min((tile_row + 1) * kTile, raster.rows); ++row) {
    for (int column = tile_column * kTile;
         column < std::min((tile_column + 1) * kTile, raster.columns); ++column) {
      const std::size_t cell = raster.at(column, row);
      if (raster.on_page[cell] == 0) continue;
      int most = 0;
      for (std::size_t c = 0; c < levels.channels; ++c) {
        most = std::max(
            most, std::abs(static_cast<int>(levels.value[cell * levels.channels + c]) - paper[c]));
      }
      raster.strength[cell] = static_cast<std::uint8_t>(std::min(255, most));
    }
  }
}

/// Estimates the paper's noise: most cells differ from paper by noise alone.
double Noise(const InkRaster& raster) {
  constexpr double kNormalMedian = 0.6745;
  std::array<std::int64_t, 256> histogram{};
  std::int64_t count = 0;
  for (std::size_t i = 0; i < raster.strength.size(); ++i) {
    if (raster.on_page[i] == 0) continue;
    ++histogram[raster.strength[i]];
    ++count;
  }
  // Ink covers at most about a third of the sheet: the median of the rest.
  std::int64_t below = 0;
  int level = 0;
  for (; level < 255; ++level) {
    below += histogram[static_cast<std::size_t>(level)];
    if (3 * below >= count) break;
  }
  return std::max(0.5, (level + 0.5) / kNormalMedian);
}

}  // namespace

double InkRaster::FaintestInk() const {
  constexpr double kFaintest = 8;
  constexpr double kSigmas = 4;
  return std::max(kFaintest, kSigmas * noise);
}

int InkRaster::Column(double u_mm) const {
  return static_cast<int>(std::lround((u_mm - low_u_mm) / kInkCell_mm));
}
int InkRaster::Row(double v_mm) const {
  return static_cast<int>(std::lround((v_mm - low_v_mm) / kInkCell_mm));
}

InkRaster TakeInkRaster(const PageView& page, const PageMap& map, double around_mm) {
  InkRaster raster;
  raster.low_u_mm = -map.half_width_mm - around_mm;
  raster.low_v_mm = -map.half_height_mm - around_mm;
  raster.columns = static_cast<int>(-2 * raster.low_u_mm / kInkCell_mm) + 1;
  raster.rows = static_cast<int>(-2 * raster.low_v_mm / kInkCell_mm) + 1;
  const std::size_t cells =
      static_cast<std::size_t>(raster.columns) * static_cast<std::size_t>(raster.rows);
  raster.strength.assign(cells, 0);
  raster.on_page.assign(cells, 0);
  Levels levels;
  levels.channels = static_cast<std::size_t>(page.channels);
  levels.tile_columns = (raster.columns + kTile - 1) / kTile;
  levels.tile_rows = (raster.rows + kTile - 1) / kTile;
  levels.value.assign(cells * levels.channels, 0);
  levels.histogram.assign(
      static_cast<std::size_t>(levels.tile_columns * levels.tile_rows) * levels.channels * 256, 0);
  ParallelFor(levels.tile_rows, [&](int row) {
    for (int column = 0; column < levels.tile_columns; ++column) {
      SampleTile(page, map, column, row, raster, levels);
    }
  });
  ParallelFor(levels.tile_rows, [&](int row) {
    for (int column = 0; column < levels.tile_columns; ++column) {
      CompareTile(levels, column, row, raster);
    }
  });
  raster.noise = Noise(raster);
  return raster;
}

double MedianStrength(const InkRaster& raster, std::span<const Leg> legs) {
  constexpr double kEnd_mm = 0.5;
  std::vector<double> levels;
  for (const Leg& leg : legs) {
    const double du = leg.end.u_mm - leg.start.u_mm;
    const double dv = leg.end.v_mm - leg.start.v_mm;
    const double length_mm = std::hypot(du, dv);
    for (double at_mm = kEnd_mm; at_mm <= length_mm - kEnd_mm; at_mm += kInkCell_mm) {
      const int column = raster.Column(leg.start.u_mm + at_mm / length_mm * du);
      const int row = raster.Row(leg.start.v_mm + at_mm / length_mm * dv);
      if (column < 0 || row < 0 || column >= raster.columns || row >= raster.rows) continue;
      levels.push_back(static_cast<double>(raster.strength[raster.at(column, row)]));
    }
  }
  return levels.empty() ? 0 : Median(levels);
}

void PaintLeg(const InkRaster& raster, const Leg& leg, double half_mm,
              std::vector<std::uint8_t>& mask) {
  // Legs run along an axis of the sheet.
  const auto [low_u, high_u] = std::minmax(leg.start.u_mm, leg.end.u_mm);
  const auto [low_v, high_v] = std::minmax(leg.start.v_mm, leg.end.v_mm);
  const int first_column = std::max(0, raster.Column(low_u - half_mm));
  const int last_column = std::min(raster.columns - 1, raster.Column(high_u + half_mm));
  const int first_row = std::max(0, raster.Row(low_v - half_mm));
  const int last_row = std::min(raster.rows - 1, raster.Row(high_v + half_mm));
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      mask[raster.at(column, row)] = 1;
    }
  }
}

namespace {

constexpr std::array<ChannelMix, kInkChannels> kMixes{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.114F, 0.587F, 0.299F}}};

constexpr double kFaintest = 8;  // levels

}  // namespace

std::string_view InkChannelName(std::size_t channel, int page_channels) {
  constexpr std::array<std::string_view, kInkChannels> kNames{"blue", "green", "red", "grey"};
  return page_channels == 1 ? kNames[3] : kNames[channel];
}

ChannelMix InkChannelMix(std::size_t channel) { return kMixes[channel]; }

std::size_t InkColour::best() const {
  std::size_t best = 0;
  for (std::size_t c = 1; c < channels; ++c) {
    if (signal(c) > signal(best)) best = c;
  }
  return best;
}

double InkColour::signal(std::size_t channel) const {
  return noise[channel] > 0 ? std::abs(contrast[channel]) / noise[channel] : 0;
}

InkColour SampleInk(const PageView& page, const PageMap& map, const SheetSettings& settings,
                    std::span<const Leg> legs) {
  constexpr double kStep_mm = 0.1;
  constexpr double kEnd_mm = 0.5;
  constexpr double kMinNoise = 0.5;  // in levels: rounding
  InkColour colour;
  colour.channels = page.channels == 1 ? 1 : kInkChannels;
  std::vector<float> samples;
  for (std::size_t c = 0; c < colour.channels; ++c) {
    std::vector<double> ink;
    std::vector<double> paper;
    std::vector<double> steps;  // paper differences from place to place
    for (const Leg& leg : legs) {
      const double du = leg.end.u_mm - leg.start.u_mm;
      const double dv = leg.end.v_mm - leg.start.v_mm;
      const double length = std::hypot(du, dv);
      const int rows = static_cast<int>((length - 2 * kEnd_mm) / kStep_mm);
      if (rows < 2) continue;
      const double part = kEnd_mm / length;
      const double side_mm = settings.leg_spacing_mm / 2;
      const SheetPoint across{-dv / length * side_mm, du / length * side_mm};
      const auto at = [&](double along, double aside) {
        return map.ToPage({leg.start.u_mm + along * du + aside * across.u_mm,
                           leg.start.v_mm + along * dv + aside * across.v_mm});
      };
      const Strip strip{at(part, -1), (1.0 / rows) * (at(1 - part, 0) - at(part, 0)),
                        at(0.5, 0) - at(0.5, -1), rows, 3};
      if (!SampleStrip(page, kMixes[c], strip, samples)) continue;
      for (std::size_t i = 0; i < samples.size(); i += 3) {
        ink.push_back(static_cast<double>(samples[i + 1]));
        for (const std::size_t side : {i, i + 2}) {
          paper.push_back(static_cast<double>(samples[side]));
          if (i > 0) steps.push_back(static_cast<double>(samples[side] - samples[side - 3]));
        }
      }
    }
    if (ink.empty()) continue;
    colour.contrast[c] = Median(ink) - Median(paper);
    colour.noise[c] = std::max(kMinNoise, RobustStandardDeviation(steps) / std::sqrt(2.0));
  }
  return colour;
}

double Strength(const InkColour& ink) {
  double most = 0;
  for (const double contrast : ink.contrast) most = std::max(most, std::abs(contrast));
  return most;
}

bool IsReadable(const InkColour& ink) {
  constexpr double kFaintestSignal = 3;
  const std::size_t best = ink.best();
  return std::abs(ink.contrast[best]) >= kFaintest && ink.signal(best) >= kFaintestSignal;
}

std::string WhyUnreadable(const InkColour& ink, double around) {
  // Twice the readable contrast: no paper is left between the ink.
  if (around >= 2 * kFaintest) {
    return "ink lies between its lines, which have run together: lower its flow or raise its "
           "nozzle";
  }
  return fmt::format(
      "its ink differs from the paper by only {:.0f} of 255 levels: use a colour that "
      "stands out",
      std::abs(ink.contrast[ink.best()]));
}

ChannelChoice ChooseChannels(const InkColour& first, const InkColour& second) {
  constexpr double kClear = 25;  // levels
  constexpr double kClearSignal = 5;
  const auto weaker = [&](std::size_t c) { return std::min(first.signal(c), second.signal(c)); };
  std::size_t common = 0;
  for (std::size_t c = 1; c < first.channels; ++c) {
    if (weaker(c) > weaker(common)) common = c;
  }
  ChannelChoice choice;
  const bool clear =
      std::min(std::abs(first.contrast[common]), std::abs(second.contrast[common])) >= kClear &&
      weaker(common) >= kClearSignal;
  choice.channel = clear ? std::array{common, common} : std::array{first.best(), second.best()};
  for (std::size_t i = 0; i < 2; ++i) {
    const double contrast = (i == 0 ? first : second).contrast[choice.channel[i]];
    choice.mix[i] = kMixes[choice.channel[i]];
    for (float& weight : choice.mix[i]) weight /= static_cast<float>(contrast == 0 ? 1 : contrast);
  }
  return choice;
}

std::vector<ForeignLeg> ForeignLegs(const SheetPlan& plan, const std::map<int, SheetPoint>& shift,
                                    double near_mm) {
  std::vector<ForeignLeg> foreign;
  for (const auto& [tool, by] : shift) {
    if (std::max(std::abs(by.u_mm), std::abs(by.v_mm)) <= near_mm) continue;
    for (const Leg& leg : LegsOfTool(plan, tool)) foreign.push_back({tool, Shifted(leg, by)});
  }
  return foreign;
}

int ForeignTool(std::span<const ForeignLeg> legs, SheetPoint low, SheetPoint high,
                double clear_mm) {
  for (const ForeignLeg& foreign : legs) {
    const auto [low_u, high_u] = std::minmax(foreign.leg.start.u_mm, foreign.leg.end.u_mm);
    const auto [low_v, high_v] = std::minmax(foreign.leg.start.v_mm, foreign.leg.end.v_mm);
    if (low_u - clear_mm < high.u_mm && high_u + clear_mm > low.u_mm &&
        low_v - clear_mm < high.v_mm && high_v + clear_mm > low.v_mm) {
      return foreign.tool;
    }
  }
  return -1;
}

std::vector<double> StrayInk(const InkRaster& raster, const SheetPlan& plan,
                             const std::map<int, SheetPoint>& shift, double ink_strength) {
  /// Margin beside a line: blur, shadow, and paper displaced from the map.
  constexpr double kBeside_mm = 0.35;
  constexpr double kInk = 0.35;  // of the reference tool's ink
  std::vector<std::uint8_t> known(raster.strength.size(), 0);
  const double half_mm = plan.settings.line_width_mm / 2 + kBeside_mm;
  for (const auto& [tool, by] : shift) {
    for (const Leg& leg : LegsOfTool(plan, tool)) {
      PaintLeg(raster, Shifted(leg, by), half_mm, known);
    }
  }
  const double threshold = std::max(raster.FaintestInk(), kInk * ink_strength);
  std::vector<double> stray;
  for (const Structure& structure : plan.structures) {
    const bool is_x = structure.axis == Axis::kX;
    const double length_mm = StructureLength_mm(plan.settings);
    const double thickness_mm = StructureThickness_mm(plan.settings);
    const double half_u_mm = (is_x ? length_mm : thickness_mm) / 2;
    const double half_v_mm = (is_x ? thickness_mm : length_mm) / 2;
    int white = 0;
    int ink = 0;
    const int last_row = std::min(raster.rows - 1, raster.Row(structure.middle.v_mm + half_v_mm));
    const int last_column =
        std::min(raster.columns - 1, raster.Column(structure.middle.u_mm + half_u_mm));
    for (int row = std::max(0, raster.Row(structure.middle.v_mm - half_v_mm)); row <= last_row;
         ++row) {
      for (int column = std::max(0, raster.Column(structure.middle.u_mm - half_u_mm));
           column <= last_column; ++column) {
        const std::size_t cell = raster.at(column, row);
        if (known[cell] != 0) continue;
        ++white;
        ink += raster.strength[cell] >= threshold ? 1 : 0;
      }
    }
    stray.push_back(white == 0 ? 0 : static_cast<double>(ink) / white);
  }
  return stray;
}

}  // namespace trammel::tool_offset
