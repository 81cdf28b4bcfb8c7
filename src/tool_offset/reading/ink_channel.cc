#include "tool_offset/reading/ink_channel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace trammel::tool_offset {
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
  constexpr double kLeastNoise = 0.5;  // of a level: rounding
  InkColour colour;
  colour.channels = page.channels == 1 ? 1 : kInkChannels;
  std::vector<float> samples;
  for (std::size_t c = 0; c < colour.channels; ++c) {
    std::vector<double> ink;
    std::vector<double> paper;
    std::vector<double> steps;  // of paper, from place to place
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
    colour.noise[c] = std::max(kLeastNoise, RobustStandardDeviation(steps) / std::sqrt(2.0));
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
  // Twice what can be read: ink that is there has lost its paper.
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

}  // namespace trammel::tool_offset
