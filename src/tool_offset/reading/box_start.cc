#include "tool_offset/reading/box_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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
    const bool upright = point.side == kLeft || point.side == kRight;
    if (upright && flip_u) point.side = point.side == kLeft ? kRight : kLeft;
    if (!upright && flip_v) point.side = point.side == kBottom ? kTop : kBottom;
    if (upright ? flip_v : flip_u) point.along_mm = -point.along_mm;
  }
  return places;
}

void DescribeTurn(SheetOnPage& sheet) {
  const PagePoint u = sheet.map.u_px_mm;
  sheet.angle_rad = std::atan2(-u.y_px, u.x_px);
  sheet.quarter_turns =
      (static_cast<int>(std::lround(sheet.angle_rad / (std::numbers::pi / 2))) + 4) % 4;
}

}  // namespace trammel::tool_offset
