#include "tool_offset/reading/line_spacing.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace trammel::tool_offset {
namespace {

/// Adds a profile's products with itself, shifted by 0, 1, 2 … samples.
void AddAutocorrelation(std::vector<float>& profile, std::vector<double>& sums) {
  const float mean =
      std::accumulate(profile.begin(), profile.end(), 0.0F) / static_cast<float>(profile.size());
  for (float& value : profile) value -= mean;
  for (std::size_t lag = 0; lag < sums.size() && lag < profile.size(); ++lag) {
    double sum = 0;
    for (std::size_t i = 0; i + lag < profile.size(); ++i) {
      sum += static_cast<double>(profile[i] * profile[i + lag]);
    }
    sums[lag] += sum;
  }
}

/// The top of a parabola through a highest sample and its neighbours.
double Top(const std::vector<double>& values, std::size_t at) {
  const double bend = values[at - 1] - 2 * values[at] + values[at + 1];
  return static_cast<double>(at) +
         (bend < 0 ? (values[at - 1] - values[at + 1]) / (2 * bend) : 0.0);
}

}  // namespace

std::optional<double> LineSpacing_px(const PageView& page, const ChannelMix& mix,
                                     const std::array<PagePoint, 4>& corners, double slack_px,
                                     double lowest_px, double highest_px) {
  constexpr int kPlaces = 60;     // along each side
  constexpr double kClear = 0.2;  // of the correlation without a shift; three lines make two thirds
  const auto lags = static_cast<std::size_t>(std::max(4.0, std::ceil(2.2 * highest_px)));
  const int columns = static_cast<int>(2 * slack_px + 3 * highest_px) + 1;
  std::vector<double> sums(lags, 0);
  std::vector<float> profile;
  const PagePoint middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  for (std::size_t side = 0; side < 4; ++side) {
    const PagePoint from = corners[side];
    const PagePoint along = corners[(side + 1) % 4] - from;
    PagePoint inward = (1 / std::max(1e-9, Length(along))) * PagePoint{-along.y_px, along.x_px};
    const PagePoint to_middle = middle - from;
    if (inward.x_px * to_middle.x_px + inward.y_px * to_middle.y_px < 0) inward = -1.0 * inward;
    for (int i = 0; i < kPlaces; ++i) {
      const PagePoint at = from + (0.05 + 0.9 * i / kPlaces) * along;
      const Strip strip{at - slack_px * inward, {}, inward, 1, columns};
      if (SampleStrip(page, mix, strip, profile)) AddAutocorrelation(profile, sums);
    }
  }
  // Down from the top at zero, then up to the first one.
  std::size_t lag = 1;
  while (lag + 1 < lags && sums[lag + 1] < sums[lag]) ++lag;
  const std::size_t valley = lag;
  while (lag + 1 < lags && sums[lag + 1] >= sums[lag]) ++lag;
  if (lag + 1 >= lags || !(sums[lag] - sums[valley] > kClear * sums[0])) return std::nullopt;
  const double spacing_px = Top(sums, lag);
  if (spacing_px < lowest_px || spacing_px > highest_px) return std::nullopt;
  return spacing_px;
}

}  // namespace trammel::tool_offset
