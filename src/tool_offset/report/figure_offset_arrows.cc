// The tools' offsets as arrows from the reference tool, seen from above the bed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_style.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

struct Arrow {
  int tool = 0;
  DataPoint tip_mm;  ///< from where it begins
  Interval x95_mm;   ///< of the tip
  Interval y95_mm;
  std::string label;
};

std::vector<Arrow> ArrowsOf(const OffsetAnalysis& analysis) {
  std::vector<Arrow> arrows;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    if (VerdictOf(tool) != Verdict::kGood) continue;
    const Quantity dx_mm = tool.dx_mm.quantity();
    const Quantity dy_mm = tool.dy_mm.quantity();
    arrows.push_back(
        {tool.tool,
         {dx_mm.value, dy_mm.value},
         dx_mm.interval95,
         dy_mm.interval95,
         fmt::format("T{}: {:+.3f}, {:+.3f} mm", tool.tool, dx_mm.value, dy_mm.value)});
  }
  return arrows;
}

/// Both ranges with one scale, around the reference tool and all arrows.
std::pair<Range, Range> EqualRanges(const std::vector<Arrow>& arrows, const RectPx& room) {
  std::vector<double> xs{0};
  std::vector<double> ys{0};
  for (const Arrow& arrow : arrows) {
    for (const double x : {arrow.x95_mm.lo, arrow.x95_mm.hi}) xs.push_back(x);
    for (const double y : {arrow.y95_mm.lo, arrow.y95_mm.hi}) ys.push_back(y);
  }
  constexpr double kLeast_mm = 0.01;
  constexpr double kSpare = 1.35;
  return WithOneScale(RangeOf(xs), RangeOf(ys), room.width, room.height, kSpare,
                      kLeast_mm / std::min(room.width, room.height));
}

/// Where no other label stands yet: at the wanted place, or as little below it as need be.
PointPx FreePlace(const RectPx& wanted, std::vector<RectPx>& taken) {
  RectPx at = wanted;
  const auto covers = [&at](const RectPx& other) {
    return at.x < other.right() && other.x < at.right() && at.y < other.bottom() &&
           other.y < at.bottom();
  };
  while (std::any_of(taken.begin(), taken.end(), covers)) at.y += 4;
  taken.push_back(at);
  return {at.x, at.bottom() - 4};
}

void DrawLabels(Canvas& canvas, const Plot& plot, const std::vector<Arrow>& arrows,
                const std::string& reference) {
  constexpr double kTallPx = 16;
  const TextStyle style{.size_px = 12, .bold = true};
  std::vector<RectPx> taken;
  // Beyond the arrow's tip, so that it stays to be seen.
  const auto label = [&](const PointPx& at, const std::string& text, bool below) {
    const double width = canvas.TextWidth(text, style);
    const RectPx& inner = plot.inner();
    const double x = std::clamp(at.x + 9, inner.x + 2, std::max(inner.x, inner.right() - width));
    const PointPx place =
        FreePlace({x, below ? at.y + 5 : at.y - kTallPx - 3, width, kTallPx}, taken);
    canvas.FillRect({place.x - 2, place.y - 12, width + 4, kTallPx}, WithAlpha(kPaper, 0.8));
    canvas.Text(place, text, style);
  };
  label(plot.At({0, 0}), reference, false);
  for (const Arrow& arrow : arrows) {
    label(plot.At(arrow.tip_mm), arrow.label, arrow.tip_mm.y < 0);
  }
}

Canvas Draw(const std::vector<Arrow>& arrows, const std::string& reference, double width_px) {
  constexpr double kLeft = 62;
  constexpr double kTop = 30;
  const double height_px = std::min(420.0, width_px + 40);
  Canvas canvas(width_px, height_px);
  const RectPx inner{kLeft, kTop, width_px - kLeft - 14, height_px - kTop - 48};
  const auto [x, y] = EqualRanges(arrows, inner);
  const int ticks = width_px < kFigureWidthPx ? 4 : 6;
  Plot plot = Plot::Around(canvas, inner, {"dx along the bed's x, to the right (mm)", x, ticks},
                           {"dy along y, to the back (mm)", y, 5}, "Where each tool lands");
  constexpr double kHeadPx = 11;
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  plot.VerticalLine(0, {.color = kMuted, .width_px = 1});
  for (const Arrow& arrow : arrows) {
    const Interval& across = arrow.x95_mm;
    const Interval& along = arrow.y95_mm;
    const PointPx low = plot.At({across.lo, along.lo});
    const PointPx high = plot.At({across.hi, along.hi});
    canvas.FillRect({low.x, high.y, high.x - low.x, low.y - high.y}, WithAlpha(kBlue, 0.35));
    DrawArrow(canvas, plot.At({0, 0}), plot.At(arrow.tip_mm), {.color = kVermilion, .width_px = 2},
              kHeadPx);
  }
  plot.Dot({0, 0}, 5, kBlue);
  DrawLabels(canvas, plot, arrows, reference);
  return canvas;
}

}  // namespace

std::optional<Figure> ToolArrowsFigure(const OffsetAnalysis& analysis) {
  const std::vector<Arrow> arrows = ArrowsOf(analysis);
  if (arrows.empty()) return std::nullopt;
  const std::string reference = fmt::format("T{}", analysis.plan.settings.reference_tool);
  Figure figure{"tools",
                fmt::format("The bed from above. Each arrow runs from where {}'s line lands to "
                            "where the tool's lands for the same command. The blue box at its tip "
                            "is the 95 % interval, often smaller than the arrow's head.",
                            reference),
                Draw(arrows, reference, kFigureWidthPx)};
  figure.seen = fmt::format("Arrows from {}:", reference);
  for (const Arrow& arrow : arrows) {
    figure.seen +=
        fmt::format(" T{} lands {:.3f} mm to the {} and {:.3f} mm to the {};", arrow.tool,
                    std::abs(arrow.tip_mm.x), arrow.tip_mm.x < 0 ? "left" : "right",
                    std::abs(arrow.tip_mm.y), arrow.tip_mm.y < 0 ? "front" : "back");
  }
  figure.seen.back() = '.';
  figure.narrow = Draw(arrows, reference, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
