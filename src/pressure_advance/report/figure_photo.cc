// The rectified photo with the lines traced in it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pressure_advance/report/figure_common.h"

namespace trammel::report {
namespace {

constexpr double kLabelPx = 62;
constexpr double kMaxHeightPx = 1400;
constexpr double kTextPitchPx = 14;  ///< labels closer than this would overlap

std::vector<PointPx> OnCanvas(const std::vector<PointPx>& edge, const RectPx& rect, double scale) {
  std::vector<PointPx> points;
  for (const PointPx& point : edge) {
    points.push_back({rect.x + (point.x + 0.5) * scale, rect.y + (point.y + 0.5) * scale});
  }
  return points;
}

Canvas Draw(const PhotoView& photo, double width_px) {
  const Frame& picture = photo.rectified;
  const double scale =
      std::min((width_px - kLabelPx - 8) / picture.width, kMaxHeightPx / picture.height);
  const RectPx rect{kLabelPx, 6, picture.width * scale, picture.height * scale};
  Canvas canvas(width_px, rect.height + 12);
  canvas.Image(picture.view(), rect, Pixels::kPhoto);
  std::vector<std::pair<double, double>> labels;  // height on the canvas, pressure advance
  for (const TracedLine& line : photo.lines) {
    const auto lower = OnCanvas(line.lower_edge, rect, scale);
    const auto upper = OnCanvas(line.upper_edge, rect, scale);
    canvas.Clip(rect);
    for (const auto* edge : {&lower, &upper}) {
      canvas.Polyline(*edge, {.color = kInk, .width_px = 2});
      canvas.Polyline(*edge, {.color = kSky, .width_px = 1});
    }
    canvas.Unclip();
    if (!lower.empty() && !upper.empty() && std::isfinite(lower.front().y) &&
        std::isfinite(upper.front().y) && std::isfinite(line.pressure_advance_s)) {
      labels.emplace_back((lower.front().y + upper.front().y) / 2, line.pressure_advance_s);
    }
  }
  std::sort(labels.begin(), labels.end());
  double last = -kTextPitchPx;
  for (const auto& [y, pressure_advance_s] : labels) {
    if (y - last >= kTextPitchPx && y < rect.bottom()) {
      canvas.Text({kLabelPx - 6, y + 4}, PressureAdvanceText(pressure_advance_s),
                  {.align = Align::kEnd});
      last = y;
    }
  }
  return canvas;
}

}  // namespace

std::optional<Figure> PhotoFigure(const ReportInput& input) {
  if (input.photo == nullptr || input.photo->rectified.width <= 0 ||
      input.photo->rectified.height <= 0 || input.photo->rectified.bgr.empty()) {
    return std::nullopt;
  }
  return Figure{
      "photo",
      "The photo as if taken from straight above, with the edges of each printed line as "
      "they were found, and the pressure advance of each (s). Where an edge strays from "
      "the filament (a reflection, a shadow), the line's width is wrong there.",
      Draw(*input.photo, kFigureWidthPx),
      1.5,
      fmt::format("Photo of the printed pattern from straight above, {} lines outlined, each "
                  "with its pressure advance beside it.",
                  input.photo->lines.size()),
      Draw(*input.photo, kNarrowWidthPx)};
}

}  // namespace trammel::report
