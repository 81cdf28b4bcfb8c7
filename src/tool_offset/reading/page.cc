#include "tool_offset/reading/page.h"

#include <fmt/format.h>

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

}  // namespace trammel::tool_offset
