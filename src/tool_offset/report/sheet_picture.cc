#include "tool_offset/report/sheet_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trammel::report {
namespace {

namespace to = tool_offset;

constexpr double kDensity = 1.25;  ///< what a canvas keeps of a picture, px per px
constexpr std::array<double, 3> kBeside{217, 220, 225};

/// Adds the page at a place, linearly between its pixels; false beside the page.
bool AddAt(const PageView& page, to::PagePoint at, std::array<double, 3>& sum) {
  if (!(at.x_px >= 0 && at.y_px >= 0 && at.x_px <= page.width - 1 && at.y_px <= page.height - 1)) {
    return false;
  }
  const int x0 = std::min(static_cast<int>(at.x_px), std::max(0, page.width - 2));
  const int y0 = std::min(static_cast<int>(at.y_px), std::max(0, page.height - 2));
  const int x1 = std::min(x0 + 1, page.width - 1);
  const int y1 = std::min(y0 + 1, page.height - 1);
  const double fx = at.x_px - x0;
  const double fy = at.y_px - y0;
  const int step = page.channels;
  for (int c = 0; c < 3; ++c) {
    const int channel = step == 3 ? c : 0;
    const auto value = [&](int x, int y) {
      return static_cast<double>(page.row(y)[std::ptrdiff_t{step} * x + channel]);
    };
    const double top = value(x0, y0) * (1 - fx) + value(x1, y0) * fx;
    const double bottom = value(x0, y1) * (1 - fx) + value(x1, y1) * fx;
    sum[static_cast<std::size_t>(c)] += top * (1 - fy) + bottom * fy;
  }
  return true;
}

PageWindow Around(const to::LocalMap& local, to::PagePoint right_px_mm, to::PagePoint down_px_mm,
                  double px_per_mm, const RectPx& rect) {
  PageWindow window;
  window.to = rect;
  window.right = (1 / px_per_mm) * right_px_mm;
  window.down = (1 / px_per_mm) * down_px_mm;
  window.origin = local.at - (rect.width / 2) * window.right - (rect.height / 2) * window.down;
  return window;
}

}  // namespace

PointPx PageWindow::At(to::PagePoint point) const {
  const to::PagePoint from = point - origin;
  const double area = right.x_px * down.y_px - right.y_px * down.x_px;
  if (area == 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
  return {to.x + (from.x_px * down.y_px - from.y_px * down.x_px) / area,
          to.y + (right.x_px * from.y_px - right.y_px * from.x_px) / area};
}

PageWindow WholePage(const PageView& page, const RectPx& room) {
  const double px = std::max(page.width / room.width, page.height / room.height);
  PageWindow window;
  window.to = {room.x, room.y, page.width / px, page.height / px};
  window.origin = {-0.5, -0.5};
  window.right = {px, 0};
  window.down = {0, px};
  return window;
}

PageWindow AlongStructure(const to::PageMap& map, const to::Structure& structure, double from_mm,
                          double to_mm, const RectPx& to_rect) {
  const bool is_x = structure.axis == to::Axis::kX;
  const double along_mm = (from_mm + to_mm) / 2;
  const to::LocalMap local = map.Near({structure.middle.u_mm + (is_x ? along_mm : 0),
                                       structure.middle.v_mm + (is_x ? 0 : along_mm)});
  const double px_per_mm = to_rect.width / (to_mm - from_mm);
  // With v to the right, u runs down: turned, not mirrored.
  return is_x ? Around(local, local.u_px_mm, -1.0 * local.v_px_mm, px_per_mm, to_rect)
              : Around(local, local.v_px_mm, local.u_px_mm, px_per_mm, to_rect);
}

void DrawPage(Canvas& canvas, const PageView& page, const PageWindow& window) {
  constexpr int kMostSamples = 4;  // along each side of a pixel of the picture
  const double density =
      std::clamp(std::max(to::Length(window.right), to::Length(window.down)), 0.5, kDensity);
  Frame picture(std::max(1, static_cast<int>(std::lround(window.to.width * density))),
                std::max(1, static_cast<int>(std::lround(window.to.height * density))));
  const to::PagePoint right = (window.to.width / picture.width) * window.right;
  const to::PagePoint down = (window.to.height / picture.height) * window.down;
  const int samples =
      std::clamp(static_cast<int>(std::lround(std::max(to::Length(right), to::Length(down)))), 1,
                 kMostSamples);
  for (int y = 0; y < picture.height; ++y) {
    std::uint8_t* out = picture.row(y);
    for (int x = 0; x < picture.width; ++x) {
      std::array<double, 3> sum{};
      int inside = 0;
      for (int i = 0; i < samples * samples; ++i) {
        const double across = x + (i % samples + 0.5) / samples;
        const double below = y + (i / samples + 0.5) / samples;
        inside += AddAt(page, window.origin + across * right + below * down, sum) ? 1 : 0;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        *out++ = inside > 0 ? static_cast<std::uint8_t>(std::lround(sum[c] / inside))
                            : static_cast<std::uint8_t>(kBeside[c]);
      }
    }
  }
  canvas.Image(picture.view(), window.to, Pixels::kPhoto);
}

}  // namespace trammel::report
