#include "tool_offset/report/offset_style.h"

#include <fmt/format.h>

#include <cmath>

#include "document/interval_text.h"

namespace trammel::report {

void HaloLine(Canvas& canvas, std::span<const PointPx> points, const Stroke& stroke) {
  constexpr double kHaloPx = 1;
  Stroke halo = stroke;
  halo.color = WithAlpha(kPaper, 0.85);
  halo.width_px += 2 * kHaloPx;
  halo.dash_px.clear();
  canvas.Polyline(points, halo);
  canvas.Polyline(points, stroke);
}

void TagText(Canvas& canvas, const PointPx& middle, std::string_view text, const TextStyle& style) {
  constexpr double kRoomPx = 2.5;
  constexpr double kBelow = 0.36;  // of the size: from the letters' middle to the baseline
  const double half = canvas.TextWidth(text, style) / 2 + kRoomPx;
  const double tall = style.size_px * 0.55 + 1;
  const double c = std::cos(style.angle_rad);
  const double s = std::sin(style.angle_rad);
  const auto at = [&](double along, double below) {
    return PointPx{middle.x + along * c - below * s, middle.y + along * s + below * c};
  };
  const PointPx patch[] = {at(-half, -tall), at(half, -tall), at(half, tall), at(-half, tall)};
  canvas.Polygon(patch, WithAlpha(kPaper, 0.88));
  TextStyle centred = style;
  centred.align = Align::kMiddle;
  canvas.Text(at(0, kBelow * style.size_px), text, centred);
}

void Cross(Canvas& canvas, const PointPx& middle, double half_px, const Stroke& stroke) {
  const PointPx down[] = {{middle.x - half_px, middle.y - half_px},
                          {middle.x + half_px, middle.y + half_px}};
  const PointPx up[] = {{middle.x - half_px, middle.y + half_px},
                        {middle.x + half_px, middle.y - half_px}};
  HaloLine(canvas, down, stroke);
  HaloLine(canvas, up, stroke);
}

std::string CombName(const tool_offset::Comb& comb) {
  if (comb.pick_up == 0) return fmt::format("T{}", comb.tool);
  return fmt::format("T{} after {} pick-up{}", comb.tool, comb.pick_up,
                     comb.pick_up == 1 ? "" : "s");
}

std::string OffsetWords(const Measured& measured) {
  return measured.good() ? WithInterval(measured.quantity(), kOffsetMillimetres)
                         : VerdictWords(measured.verdict());
}

}  // namespace trammel::report
