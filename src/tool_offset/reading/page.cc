#include "tool_offset/reading/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace trammel::tool_offset {
namespace {

bool Inside(const PageView& page, PagePoint point) {
  return point.x_px >= 0 && point.y_px >= 0 && point.x_px < page.width - 1 &&
         point.y_px < page.height - 1;
}

template <int kChannels>
float Mixed(const std::uint8_t* pixel, const ChannelMix& mix) {
  if constexpr (kChannels == 1) return mix[0] * static_cast<float>(pixel[0]);
  return mix[0] * static_cast<float>(pixel[0]) + mix[1] * static_cast<float>(pixel[1]) +
         mix[2] * static_cast<float>(pixel[2]);
}

template <int kChannels>
void Sample(const PageView& page, const ChannelMix& mix, const Strip& strip, float* out) {
  for (int r = 0; r < strip.rows; ++r) {
    const PagePoint start = strip.origin + static_cast<double>(r) * strip.row_step;
    for (int c = 0; c < strip.columns; ++c) {
      const double x = start.x_px + c * strip.column_step.x_px;
      const double y = start.y_px + c * strip.column_step.y_px;
      const int x0 = static_cast<int>(x);
      const int y0 = static_cast<int>(y);
      const auto fx = static_cast<float>(x - x0);
      const auto fy = static_cast<float>(y - y0);
      const std::uint8_t* upper = page.row(y0) + std::ptrdiff_t{kChannels} * x0;
      const std::uint8_t* lower = upper + page.stride;
      const float top = Mixed<kChannels>(upper, mix);
      const float bottom = Mixed<kChannels>(lower, mix);
      const float top_step = Mixed<kChannels>(upper + kChannels, mix) - top;
      const float bottom_step = Mixed<kChannels>(lower + kChannels, mix) - bottom;
      const float above = top + fx * top_step;
      *out++ = above + fy * (bottom + fx * bottom_step - above);
    }
  }
}

}  // namespace

double Length(PagePoint a) { return std::hypot(a.x_px, a.y_px); }

Result<void> CheckPage(const PageView& page) {
  constexpr int kSmallest_px = 200;
  if (page.channels != 1 && page.channels != 3) {
    return Fail(fmt::format(
        "a scanned page has 1 (grey) or 3 (colour) channels, this one {}; scan as grey or RGB",
        page.channels));
  }
  if (page.data == nullptr || page.width < kSmallest_px || page.height < kSmallest_px) {
    return Fail(
        fmt::format("the page is {} x {} pixels, too small to hold a sheet; scan the whole sheet "
                    "at 300 dpi or more",
                    page.width, page.height));
  }
  if (page.stride < std::ptrdiff_t{page.channels} * page.width) {
    return Fail(fmt::format("a row of {} pixels with {} channels cannot take {} bytes", page.width,
                            page.channels, page.stride));
  }
  return {};
}

bool SampleStrip(const PageView& page, const ChannelMix& mix, const Strip& strip,
                 std::vector<float>& out) {
  if (strip.rows < 1 || strip.columns < 1) return false;
  const PagePoint along = static_cast<double>(strip.rows - 1) * strip.row_step;
  const PagePoint across = static_cast<double>(strip.columns - 1) * strip.column_step;
  for (const PagePoint corner :
       {strip.origin, strip.origin + along, strip.origin + across, strip.origin + along + across}) {
    if (!Inside(page, corner)) return false;  // also what is not a number
  }
  out.resize(static_cast<std::size_t>(strip.rows) * static_cast<std::size_t>(strip.columns));
  if (page.channels == 1) {
    Sample<1>(page, mix, strip, out.data());
  } else {
    Sample<3>(page, mix, strip, out.data());
  }
  return true;
}

namespace {

/// Computes the cubic, which is meaningless beyond the box.
double Cubic(const std::array<double, 4>& c, double t) {
  const double x = std::clamp(t, -1.05, 1.05);
  return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

double Between(double lower, double upper, double t) {
  return (lower * (1 - t) + upper * (1 + t)) / 2;
}

}  // namespace

SheetPoint CameraBend::OnPlane(SheetPoint point) const {
  const double u = point.u_mm / reach_mm;
  const double v = point.v_mm / reach_mm;
  const double above_mm = bow_mm[0] * u * u + bow_mm[1] * u * v + bow_mm[2] * v * v;
  const double outwards = above_mm / height_mm;
  return {point.u_mm + outwards * (point.u_mm - foot.u_mm),
          point.v_mm + outwards * (point.v_mm - foot.v_mm)};
}

PagePoint CameraBend::Seen(PagePoint straight) const {
  const PagePoint from_centre = straight - centre;
  const double r = Length(from_centre) / focal_px;
  const double r2 = r * r;
  return centre + (1 + r2 * (radial[0] + r2 * radial[1])) * from_centre;
}

PagePoint PageMap::ToPage(SheetPoint point) const {
  if (camera) point = camera->OnPlane(point);
  const double s = point.u_mm / half_width_mm;
  const double t = point.v_mm / half_height_mm;
  const double u_mm = point.u_mm + Between(Cubic(bend_mm[kLeft], t), Cubic(bend_mm[kRight], t), s);
  const double v_mm = point.v_mm + Between(Cubic(bend_mm[kBottom], s), Cubic(bend_mm[kTop], s), t);
  const double nearness = 1 + lean_per_mm.u_mm * u_mm + lean_per_mm.v_mm * v_mm;
  const PagePoint straight = middle + (u_mm / nearness) * u_px_mm + (v_mm / nearness) * v_px_mm;
  return camera ? camera->Seen(straight) : straight;
}

LocalMap PageMap::Near(SheetPoint point) const {
  constexpr double kStep_mm = 1;
  const auto slope = [&](double u_mm, double v_mm) {
    return (1 / (2 * kStep_mm)) * (ToPage({point.u_mm + u_mm, point.v_mm + v_mm}) -
                                   ToPage({point.u_mm - u_mm, point.v_mm - v_mm}));
  };
  return {ToPage(point), slope(kStep_mm, 0), slope(0, kStep_mm)};
}

double PageMap::perspective() const {
  return 2 * std::hypot(lean_per_mm.u_mm * half_width_mm, lean_per_mm.v_mm * half_height_mm);
}

std::optional<PageMap> MapOfCorners(const std::array<PagePoint, 4>& corners, double width_mm,
                                    double height_mm) {
  const auto cross = [](PagePoint a, PagePoint b) { return a.x_px * b.y_px - a.y_px * b.x_px; };
  const double way = cross(corners[1] - corners[0], corners[3] - corners[0]);
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = cross(corners[(i + 1) % 4] - corners[i], corners[(i + 3) % 4] - corners[i]);
    if (!(turn * way > 0)) return std::nullopt;
  }
  // Projection of a unit square's corners (Heckbert 1989), with s and t from 0 to 1.
  const PagePoint along = corners[1] - corners[2];
  const PagePoint aside = corners[3] - corners[2];
  const PagePoint rest = corners[0] - corners[1] + corners[2] - corners[3];
  const double g = cross(rest, aside) / cross(along, aside);
  const double h = cross(along, rest) / cross(along, aside);
  const PagePoint s_px = corners[1] - corners[0] + g * corners[1];
  const PagePoint t_px = corners[3] - corners[0] + h * corners[3];
  // Relative to the middle, in mm.
  const double nearness = 1 + g / 2 + h / 2;
  PageMap map;
  map.half_width_mm = width_mm / 2;
  map.half_height_mm = height_mm / 2;
  map.lean_per_mm = {g / nearness / width_mm, h / nearness / height_mm};
  map.middle = (1 / nearness) * (corners[0] + 0.5 * s_px + 0.5 * t_px);
  map.u_px_mm = (1 / (nearness * width_mm)) * (s_px - g * map.middle);
  map.v_px_mm = (1 / (nearness * height_mm)) * (t_px - h * map.middle);
  return map;
}

std::optional<LinePlace> HalfInkPlace(std::span<const float> ink, double low, double high) {
  // Sample i covers [i - 0.5, i + 0.5].
  if (!(low >= -0.5) || !(high <= static_cast<double>(ink.size()) - 0.5) || !(low < high)) {
    return std::nullopt;
  }
  const auto first = static_cast<std::size_t>(std::floor(low + 0.5));
  const std::size_t last =
      std::min(static_cast<std::size_t>(std::floor(high + 0.5)), ink.size() - 1);
  const auto part = [&](std::size_t i) {
    const double at = static_cast<double>(i);
    return std::min(high, at + 0.5) - std::max(low, at - 0.5);
  };
  double whole = 0;
  for (std::size_t i = first; i <= last; ++i) whole += part(i) * static_cast<double>(ink[i]);
  if (!(whole > 0)) return std::nullopt;
  double below = 0;
  for (std::size_t i = first; i <= last; ++i) {
    const double here = part(i) * static_cast<double>(ink[i]);
    if (here > 0 && below + here >= whole / 2) {
      const double start = std::max(low, static_cast<double>(i) - 0.5);
      return LinePlace{start + (whole / 2 - below) / static_cast<double>(ink[i]), whole};
    }
    below += here;
  }
  return std::nullopt;
}

}  // namespace trammel::tool_offset
