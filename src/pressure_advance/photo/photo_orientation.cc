#include "pressure_advance/photo/photo_orientation.h"

#include <fmt/format.h>

#include <cmath>

namespace trammel::pressure_advance {

std::string ToString(PhotoSide side) {
  switch (side) {
    case PhotoSide::kBottom:
      return "bottom";
    case PhotoSide::kTop:
      return "top";
    case PhotoSide::kLeft:
      return "left";
    case PhotoSide::kRight:
      return "right";
  }
  return "bottom";
}

Heading HeadingBetween(const vision::PointPx& a1, const vision::PointPx& a2,
                       const vision::PointPx& b1, const vision::PointPx& b2) {
  const double x = b1.x + b2.x - a1.x - a2.x, y = b1.y + b2.y - a1.y - a2.y;
  const double length = std::hypot(x, y);
  return {x / length, y / length};
}

double Towards(const Heading& heading, PhotoSide side) {
  switch (side) {
    case PhotoSide::kBottom:
      return heading.y;
    case PhotoSide::kTop:
      return -heading.y;
    case PhotoSide::kLeft:
      return -heading.x;
    case PhotoSide::kRight:
      return heading.x;
  }
  return 0;
}

PhotoSide SideTowards(const Heading& heading) {
  const bool upright = std::abs(heading.y) >= std::abs(heading.x);
  if (upright) return heading.y > 0 ? PhotoSide::kBottom : PhotoSide::kTop;
  return heading.x > 0 ? PhotoSide::kRight : PhotoSide::kLeft;
}

PartSides SidesOf(const vision::Quad& corners) {
  const auto& [top_left, top_right, bottom_right, bottom_left] = corners;
  return {SideTowards(HeadingBetween(top_left, top_right, bottom_left, bottom_right)),
          SideTowards(HeadingBetween(top_left, bottom_left, top_right, bottom_right))};
}

bool IsAlong(const Heading& heading, PhotoSide side) {
  constexpr double kMinAlong = 0.26;  // about 15 degrees
  return std::abs(Towards(heading, side)) >= kMinAlong;
}

std::string SidesAlong(const Heading& heading) {
  std::string sides;
  for (const PhotoSide side :
       {PhotoSide::kBottom, PhotoSide::kTop, PhotoSide::kLeft, PhotoSide::kRight}) {
    if (!IsAlong(heading, side)) continue;
    sides += (sides.empty() ? "" : " or ") + ToString(side);
  }
  return sides;
}

PhotoSide UsualSide(const Heading& down) {
  if (IsAlong(down, PhotoSide::kBottom)) return PhotoSide::kBottom;
  return PhotoSide::kLeft;
}

PhotoSide Opposite(PhotoSide side) {
  switch (side) {
    case PhotoSide::kBottom:
      return PhotoSide::kTop;
    case PhotoSide::kTop:
      return PhotoSide::kBottom;
    case PhotoSide::kLeft:
      return PhotoSide::kRight;
    case PhotoSide::kRight:
      return PhotoSide::kLeft;
  }
  return side;
}

OrientationReading ReadOrientation(const std::vector<LineProfile>& profiles,
                                   const PhotoOptions& options, const Heading& along,
                                   PhotoSide from, bool order_on_trust,
                                   std::span<const ShownPart> parts) {
  OrientationReading result;
  std::optional<bool> known;
  if (options.start) {
    if (!IsAlong(along, *options.start)) {
      result.refusal =
          fmt::format("the lines run from {} in this photo, so they cannot start at the {}",
                      SidesAlong(along), ToString(*options.start));
      return result;
    }
    known = Towards(along, *options.start) > 0;
  }
  const TrendReading reading =
      ReadTrend(MeasureWidthTrend(profiles), options.slow_before, options.slow_after, known, parts);
  const TrendReading free = known ? ReadTrend(MeasureWidthTrend(profiles), options.slow_before,
                                              options.slow_after, std::nullopt, parts)
                                  : reading;
  // Each reading is the sum of the two largest of a few independent slopes: for noise alone two
  // differ by 1 to 2 scatters.
  constexpr double kMinLead = 6;
  const bool sure = reading.lead >= kMinLead;
  result.upside_down = sure && reading.upside_down;
  if (known && free.order_compared && free.lead >= kMinLead && free.reversed != *known) {
    result.refusal = fmt::format(
        "the lines say that they start at the other end ({:.0f} times the scatter, {:.0f} ahead of "
        "the other readings) than the {}: check the side (--start), the segments and whether the "
        "pattern has the mark that it is said to have",
        free.significance, free.lead, ToString(*options.start));
  } else if (result.upside_down && options.from) {
    result.refusal = fmt::format(
        "the lines say that the PA list runs the other way: they grow thinner with rising PA where "
        "they should grow wider ({:.0f} times the scatter). The photo may be upside down: give the "
        "side at which the first line lies (now: {}) or none, or the other start",
        reading.significance, ToString(from));
  } else if (!known && !sure) {
    result.refusal = fmt::format(
        "the lines do not show at which end they were printed first (widths change with PA by "
        "{:.1f} times the scatter, {:.1f} ahead of the other reading; {:.0f} ahead are needed); "
        "give the side at which they start (--start left, right, top or bottom)",
        reading.significance, reading.lead, kMinLead);
  } else if (!order_on_trust && !(sure && reading.order_compared)) {
    result.refusal = fmt::format(
        "the lines do not show which of them is the first; give the side at which it lies "
        "(--from {})",
        ToString(from));
  }
  const auto hidden = [&](double change) {
    const double at = reading.reversed ? 1 - change : change;
    constexpr double kBeside = 0.03;  // line lengths: half of a bulge
    return at < reading.shown.begin + kBeside || at > reading.shown.end - kBeside;
  };
  if (result.refusal.empty() && parts.size() > 1 &&
      (!reading.segments || hidden(reading.segments->fast_begin) ||
       hidden(reading.segments->fast_end))) {
    result.refusal =
        "the lines leave the photo before both of their speed changes are seen; take a photo that "
        "shows the whole lines";
  }
  result.reversed = known.value_or(reading.reversed);
  result.segments = reading.segments;
  result.shown = reading.shown;
  return result;
}

}  // namespace trammel::pressure_advance
