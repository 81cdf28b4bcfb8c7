#include "document/bed_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "settings/material.h"

namespace trammel::report {
namespace {

void DrawPlate(Canvas& canvas, const RectPx& inner, settings::BedShape shape) {
  const Stroke edge{.color = kMuted, .width_px = 1.5};
  if (shape == settings::BedShape::kRectangle) {
    canvas.FillRect(inner, kPlate);
    canvas.StrokeRect(inner, edge);
    return;
  }
  constexpr int kCorners = 120;
  std::vector<PointPx> outline;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    outline.push_back({inner.x + inner.width / 2 * (1 + std::cos(angle)),
                       inner.y + inner.height / 2 * (1 + std::sin(angle))});
  }
  canvas.Polygon(outline, kPlate, edge);
}

}  // namespace

Plot EvenPlot(Canvas& canvas, const RectPx& room, const Axis& x, const Axis& y,
              const std::string& title) {
  const double scale =
      std::min(room.width / (x.range.hi - x.range.lo), room.height / (y.range.hi - y.range.lo));
  const double width = (x.range.hi - x.range.lo) * scale;
  const double height = (y.range.hi - y.range.lo) * scale;
  const RectPx inner{room.x + (room.width - width) / 2, room.y, width, height};
  return Plot::Around(canvas, inner, x, y, title);
}

Plot BedPlot(Canvas& canvas, const RectPx& room, const settings::PrinterSettings& printer) {
  const Range x{printer.bed_origin_x_mm, printer.bed_origin_x_mm + printer.bed_size_x_mm};
  const Range y{printer.bed_origin_y_mm, printer.bed_origin_y_mm + printer.bed_size_y_mm};
  Plot plot =
      EvenPlot(canvas, room, {"x (mm)", x, 6}, {"y (mm)", y, 6},
               fmt::format("Bed {:.4g} × {:.4g} mm", printer.bed_size_x_mm, printer.bed_size_y_mm));
  DrawPlate(canvas, plot.inner(), printer.bed_shape);
  return plot;
}

std::string SpelledOut(std::string temperatures) {
  const auto replace = [&temperatures](const std::string& plain, const std::string& spelled) {
    const std::size_t at = temperatures.find(plain);
    if (at != std::string::npos) temperatures.replace(at, plain.size(), spelled);
  };
  for (const settings::Material& material : settings::Materials()) {
    const std::string name(material.name);
    std::string capitals = name;
    for (char& letter : capitals) letter = static_cast<char>(std::toupper(letter));
    if (temperatures.starts_with(name + ":")) replace(name, capitals);
    for (int value = 0; value < 2; ++value) replace("(" + name + ")", "(" + capitals + ")");
  }
  replace("degC", "°C");
  return temperatures;
}

}  // namespace trammel::report
