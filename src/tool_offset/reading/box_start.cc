#include "tool_offset/reading/box_start.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace trammel::tool_offset {
int InkStrength(const SmallPage& small) {
  constexpr double kPart = 0.003;
  constexpr int kFaintest = 12;
  std::array<std::int64_t, 256> histogram{};
  for (const std::uint8_t value : small.strength) ++histogram[value];
  const auto wanted = static_cast<std::int64_t>(kPart * static_cast<double>(small.strength.size()));
  std::int64_t above = 0;
  int level = 255;
  while (level > kFaintest && (above += histogram[static_cast<std::size_t>(level)]) < wanted) {
    --level;
  }
  return level;
}

ChannelMix MixOfSides(const SmallPage& small, const BoxCandidate& candidate, int threshold) {
  std::array<double, 3> difference{};
  int count = 0;
  for (std::size_t side = 0; side < 4; ++side) {
    const PagePoint from = candidate.corners[side];
    const PagePoint to = candidate.corners[(side + 1) % 4];
    const int steps = static_cast<int>(Length(to - from));
    for (int i = 0; i < steps; ++i) {
      const PagePoint at = from + (static_cast<double>(i) / steps) * (to - from);
      for (int dy = -2; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) {
          const int x = static_cast<int>(std::lround(at.x_px)) + dx;
          const int y = static_cast<int>(std::lround(at.y_px)) + dy;
          if (x < 0 || y < 0 || x >= small.width || y >= small.height) continue;
          if (small.strength[small.at(x, y)] < threshold) continue;
          ++count;
          for (int c = 0; c < small.channels; ++c) {
            const std::size_t k = small.at(x, y) * static_cast<std::size_t>(small.channels) +
                                  static_cast<std::size_t>(c);
            difference[static_cast<std::size_t>(c)] +=
                static_cast<double>(small.pixels[k]) - static_cast<double>(small.background[k]);
          }
        }
      }
    }
  }
  double squares = 0;
  for (double& value : difference) {
    value /= std::max(1, count);
    squares += value * value;
  }
  ChannelMix mix{};
  for (std::size_t c = 0; c < 3; ++c) {
    mix[c] = static_cast<float>(difference[c] / std::max(1.0, squares));
  }
  return mix;
}

std::optional<PageMap> StartMap(const SmallPage& small, const BoxCandidate& candidate,
                                std::size_t side, const SheetPlan& plan) {
  std::array<PagePoint, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const PagePoint corner = candidate.corners[(i + side) % 4];
    corners[i] = small.OnPage(corner.x_px, corner.y_px);
  }
  // Counter-clockwise on the sheet is clockwise on the page, whose y runs down.
  const PagePoint first = corners[1] - corners[0];
  const PagePoint last = corners[3] - corners[0];
  if (first.x_px * last.y_px - first.y_px * last.x_px > 0) {
    std::swap(corners[0], corners[3]);
    std::swap(corners[1], corners[2]);
  }
  return MapOfCorners(corners, plan.width_mm, plan.height_mm);
}

PageMap Turned(const PageMap& map, bool flip_u, bool flip_v) {
  PageMap turned = map;
  const auto reverse = [](std::array<double, 4>& cubic) {
    cubic[1] = -cubic[1];
    cubic[3] = -cubic[3];
  };
  const auto negate = [](std::array<double, 4>& cubic) {
    for (double& value : cubic) value = -value;
  };
  if (flip_u) {
    turned.lean_per_mm.u_mm = -turned.lean_per_mm.u_mm;
    turned.u_px_mm = -1.0 * turned.u_px_mm;
    std::swap(turned.bend_mm[kLeft], turned.bend_mm[kRight]);
    negate(turned.bend_mm[kLeft]);
    negate(turned.bend_mm[kRight]);
    reverse(turned.bend_mm[kBottom]);
    reverse(turned.bend_mm[kTop]);
  }
  if (flip_v) {
    turned.lean_per_mm.v_mm = -turned.lean_per_mm.v_mm;
    turned.v_px_mm = -1.0 * turned.v_px_mm;
    std::swap(turned.bend_mm[kBottom], turned.bend_mm[kTop]);
    negate(turned.bend_mm[kBottom]);
    negate(turned.bend_mm[kTop]);
    reverse(turned.bend_mm[kLeft]);
    reverse(turned.bend_mm[kRight]);
  }
  return turned;
}

std::vector<SidePoint> Turned(std::vector<SidePoint> places, bool flip_u, bool flip_v) {
  for (SidePoint& point : places) {
    const bool upright = IsUpright(point.side);
    if (upright && flip_u) point.side = point.side == kLeft ? kRight : kLeft;
    if (!upright && flip_v) point.side = point.side == kBottom ? kTop : kBottom;
    if (upright ? flip_v : flip_u) point.along_mm = -point.along_mm;
  }
  return places;
}

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

/// Returns the vertex of a parabola through a highest sample and its neighbours.
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
  constexpr double kClear = 0.2;  // of the correlation at zero shift; three lines give two thirds
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
  // Down from the maximum at zero, then up to the first peak.
  std::size_t lag = 1;
  while (lag + 1 < lags && sums[lag + 1] < sums[lag]) ++lag;
  const std::size_t valley = lag;
  while (lag + 1 < lags && sums[lag + 1] >= sums[lag]) ++lag;
  if (lag + 1 >= lags || !(sums[lag] - sums[valley] > kClear * sums[0])) return std::nullopt;
  const double spacing_px = Top(sums, lag);
  if (spacing_px < lowest_px || spacing_px > highest_px) return std::nullopt;
  return spacing_px;
}

namespace {

struct Sum {
  double sum = 0;
  int count = 0;
  [[nodiscard]] double Mean() const { return sum / std::max(1, count); }
};

}  // namespace

SheetPlan BarOf(const SheetPlan& plan) {
  SheetPlan bar;
  bar.original = true;
  bar.settings = plan.settings;
  const double inset_mm = plan.box_insets_mm.back() / 2;
  bar.settings.line_width_mm += 2 * inset_mm;
  bar.box_insets_mm = {0};
  bar.width_mm = plan.width_mm - 2 * inset_mm;
  bar.height_mm = plan.height_mm - 2 * inset_mm;
  return bar;
}

double ReferenceMatch(const PageView& page, const SheetPlan& plan, const ChannelMix& mix,
                      const PageMap& map) {
  constexpr double kFrom_mm = 0.3;  // beyond the other comb's turns; and to the own spine
  constexpr int kPlaces = 3;
  const SheetSettings& settings = plan.settings;
  const double half_mm = settings.leg_spacing_mm / 2;
  const double low_mm = settings.overlap_mm / 2 + plan.turn_mm + kFrom_mm;
  const double high_mm = settings.leg_length_mm - settings.overlap_mm / 2 - kFrom_mm;
  Sum ink;
  Sum paper;
  std::vector<float> sample;
  for (const Structure& structure : plan.structures) {
    const auto add = [&](double along_mm, Sum& sum) {
      for (int i = 0; i < kPlaces; ++i) {
        const double across_mm = Across(structure.axis, structure.middle) + low_mm +
                                 (high_mm - low_mm) * i / (kPlaces - 1);
        const SheetPoint at = PointAt(structure.axis, along_mm, across_mm);
        // A point outside the page is no ink.
        if (SampleStrip(page, mix, {map.ToPage(at), {}, {}, 1, 1}, sample)) {
          sum.sum += static_cast<double>(sample[0]);
        }
        ++sum.count;
      }
    };
    const std::size_t comb = structure.swapped ? 0 : 1;  // the reference tool's own
    for (int finger = 0; finger < settings.teeth; ++finger) {
      if (finger == structure.incomplete[comb]) continue;
      const double at_mm = FingerPosition_mm(plan, structure, comb, finger);
      for (const double aside_mm : {-half_mm, half_mm}) add(at_mm + aside_mm, ink);
      add(at_mm, paper);
      add(at_mm - settings.pitch_mm / 2, paper);
    }
  }
  return ink.Mean() - paper.Mean();
}

}  // namespace trammel::tool_offset
