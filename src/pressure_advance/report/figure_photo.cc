// Draws the rectified photo with the traced lines.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kLabelPx = 62;
constexpr double kMaxHeightPx = 1400;
constexpr double kTextPitchPx = 14;  ///< labels closer than this would overlap

// Returns an edge of a traced line: -1 the lower one, 1 the upper one in the picture's rows.
std::vector<PointPx> OnCanvas(const pa::TracedLine& line, double side, const RectPx& rect,
                              double scale) {
  std::vector<PointPx> points;
  for (std::size_t i = 0; i < line.x_px.size(); ++i) {
    const double y = line.centre_px[i] - side * line.width_px[i] / 2;
    points.push_back({rect.x + (line.x_px[i] + 0.5) * scale, rect.y + (y + 0.5) * scale});
  }
  return points;
}

// Returns the line whose pressure advance is nearest to the answer; the number of lines without an
// answer.
std::size_t BestLine(const pa::PhotoView& photo, const Measured& answer) {
  if (!answer.good()) return photo.lines.size();
  const double value_s = answer.quantity().value;
  const auto away = [value_s](const pa::TracedLine& line) {
    return std::abs(line.pressure_advance_s - value_s);
  };
  const auto best = std::ranges::min_element(photo.lines, {}, away);
  return static_cast<std::size_t>(best - photo.lines.begin());
}

Canvas Draw(const pa::PhotoView& photo, std::size_t best, double width_px) {
  const Frame& picture = photo.rectified;
  const double scale =
      std::min((width_px - kLabelPx - 8) / picture.width, kMaxHeightPx / picture.height);
  const RectPx rect{kLabelPx, 6, picture.width * scale, picture.height * scale};
  Canvas canvas(width_px, rect.height + 12);
  canvas.Image(picture.view(), rect, Pixels::kPhoto);
  struct Label {
    double y = 0;
    double pressure_advance_s = 0;
    bool best = false;
  };
  std::vector<Label> labels;
  for (std::size_t i = 0; i < photo.lines.size(); ++i) {
    const pa::TracedLine& line = photo.lines[i];
    const bool is_best = i == best;
    const auto lower = OnCanvas(line, -1, rect, scale);
    const auto upper = OnCanvas(line, 1, rect, scale);
    canvas.Clip(rect);
    for (const auto* edge : {&lower, &upper}) {
      canvas.Polyline(*edge, {.color = kInk, .width_px = is_best ? 4.0 : 2.0});
      canvas.Polyline(*edge,
                      {.color = is_best ? kVermilion : kSky, .width_px = is_best ? 2.5 : 1.0});
    }
    canvas.Unclip();
    if (!lower.empty() && !upper.empty() && std::isfinite(lower.front().y) &&
        std::isfinite(upper.front().y) && std::isfinite(line.pressure_advance_s)) {
      labels.push_back({(lower.front().y + upper.front().y) / 2, line.pressure_advance_s, is_best});
    }
  }
  // The best line's label first: its neighbours' labels are dropped if there is no room for all.
  std::ranges::stable_sort(labels, [](const Label& a, const Label& b) { return a.best > b.best; });
  std::vector<double> taken;
  for (const Label& label : labels) {
    const bool free =
        std::ranges::all_of(taken, [&](double y) { return std::abs(y - label.y) >= kTextPitchPx; });
    if (!free || label.y >= rect.bottom() || label.y < 0) continue;
    canvas.Text(
        {kLabelPx - 6, label.y + 4},
        (label.best ? "▸ " : "") + PressureAdvanceText(label.pressure_advance_s),
        {.color = label.best ? kVermilion : kInk, .align = Align::kEnd, .bold = label.best});
    taken.push_back(label.y);
  }
  return canvas;
}

Canvas Draw(const RefusedPhoto& refused, double width_px) {
  const Frame& picture = refused.picture;
  const double scale =
      std::min(width_px / picture.width, kMaxHeightPx / static_cast<double>(picture.height));
  const RectPx rect{0, 0, picture.width * scale, picture.height * scale};
  Canvas canvas(width_px, rect.height);
  canvas.Image(picture.view(), rect, Pixels::kPhoto);
  std::vector<PointPx> outline;
  // An outline that leaves the picture follows its border.
  const double border_px = std::min({3.0, rect.width / 2, rect.height / 2});
  for (const vision::PointPx& p : refused.outline) {
    outline.push_back({std::clamp(p.x * rect.width, border_px, rect.width - border_px),
                       std::clamp(p.y * rect.height, border_px, rect.height - border_px)});
  }
  if (!outline.empty()) outline.push_back(outline.front());
  canvas.Polyline(outline, {.color = kInk, .width_px = 5});
  canvas.Polyline(outline, {.color = kVermilion, .width_px = 3});
  return canvas;
}

Figure FigureOf(const RefusedPhoto& refused) {
  const std::string seen = refused.outline.empty()
                               ? "No pattern was found in it."
                               : "The outline holds what was taken for the pattern.";
  return {"photo", "The photo as it was taken. " + seen, Draw(refused, kFigureWidthPx),
          1.5,     "The photo as it was taken. " + seen, Draw(refused, kNarrowWidthPx)};
}

}  // namespace

std::optional<Figure> PhotoFigure(const AnalysisRun& input) {
  if (input.refused) return FigureOf(*input.refused);
  if (!input.photo || input.photo->rectified.width <= 0 || input.photo->rectified.height <= 0 ||
      input.photo->rectified.bgr.empty()) {
    return std::nullopt;
  }
  const std::size_t best = BestLine(*input.photo, input.analysis.pressure_advance);
  return Figure{
      "photo",
      "The photo as if taken from straight above, with the edges of each printed line as "
      "they were found, and the pressure advance of each (s); the line nearest to the answer is "
      "drawn bold. Where an edge strays from the filament (a reflection, a shadow), the line's "
      "width is wrong there.",
      Draw(*input.photo, best, kFigureWidthPx),
      1.5,
      fmt::format("Photo of the printed pattern from straight above, {} lines outlined, each "
                  "with its pressure advance beside it.",
                  input.photo->lines.size()),
      Draw(*input.photo, best, kNarrowWidthPx)};
}

}  // namespace trammel::report
