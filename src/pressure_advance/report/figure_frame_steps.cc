// One frame from picture to cross-section (figures 4 and 5).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "document/interval_text.h"
#include "pressure_advance/report/figure_common.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kSectionPx = 250;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool Complete(const pa::FrameSteps& steps) {
  const auto same = [&](const Frame& frame) {
    return frame.width == steps.crop.width && frame.height == steps.crop.height &&
           frame.bgr.size() == steps.crop.bgr.size();
  };
  const auto rows = static_cast<std::size_t>(std::max(0, steps.crop.height));
  return steps.crop.width > 0 && rows > 0 &&
         steps.crop.bgr.size() == rows * static_cast<std::size_t>(steps.crop.width) * 3 &&
         same(steps.masked) && same(steps.blurred) && steps.paper_centre_px.size() == rows &&
         steps.centre_px.size() == rows && steps.centre_sigma_px.size() == rows;
}

/// The largest rectangle of the picture's shape in the middle of `room`.
RectPx Fitted(const Frame& picture, const RectPx& room) {
  const double scale = std::min(room.width / picture.width, room.height / picture.height);
  const double width = picture.width * scale;
  const double height = picture.height * scale;
  return {room.x + (room.width - width) / 2, room.y, width, height};
}

std::size_t Columns(bool broad) { return broad ? 4 : 2; }

/// As high as the crop is at the width that it has, up to a limit that tall crops are fitted into.
double PictureRowPx(const Frame& crop, double width_px, bool broad) {
  constexpr double kMargins_px = 16;
  constexpr double kWords_px = 40;
  const double room_px = width_px / static_cast<double>(Columns(broad)) - kMargins_px;
  return std::min(kWords_px + room_px * crop.height / crop.width, broad ? 262.0 : 210.0);
}

void OverlayCentres(Canvas& canvas, const RectPx& rect, const pa::FrameSteps& steps) {
  const double scale = rect.width / steps.crop.width;
  std::vector<PointPx> line;
  for (std::size_t row = 0; row < steps.centre_px.size(); ++row) {
    const double x =
        steps.centre_sigma_px[row] > 0 ? static_cast<double>(steps.centre_px[row]) : kNan;
    line.push_back({rect.x + (x + 0.5) * scale, rect.y + (static_cast<double>(row) + 0.5) * scale});
  }
  canvas.Clip(rect);
  canvas.Polyline(line, {.color = kPaper, .width_px = 4});
  canvas.Polyline(line, {.color = kBlue, .width_px = 2});
  canvas.Unclip();
}

/// In a row, or in two where there is no room.
void DrawPictures(Canvas& canvas, const pa::FrameSteps& steps, bool broad) {
  const std::array<std::pair<const char*, const Frame*>, 4> pictures = {{
      {"1  crop", &steps.crop},
      {"2  masked by red", &steps.masked},
      {"3  grey, blurred", &steps.blurred},
      {"4  line found", &steps.crop},
  }};
  const std::size_t columns = Columns(broad);
  const double width = canvas.width_px() / static_cast<double>(columns);
  const double height = PictureRowPx(steps.crop, canvas.width_px(), broad);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const double x = static_cast<double>(i % columns) * width;
    const double top = static_cast<double>(i / columns) * height;
    canvas.Text({x + 10, top + 20}, pictures[i].first, {.size_px = kTitleTextPx, .bold = true});
    const RectPx rect = Fitted(*pictures[i].second, {x + 8, top + 30, width - 16, height - 40});
    canvas.Image(pictures[i].second->view(), rect, Pixels::kPhoto);
    if (i == 3) {
      OverlayCentres(canvas, rect, steps);
    }
  }
}

void DrawSection(Canvas& canvas, const pa::FrameSteps& steps, double top) {
  const double width = steps.crop.width;
  std::vector<DataPoint> paper;
  std::vector<DataPoint> found;
  std::vector<double> seen;
  for (std::size_t row = 0; row < steps.centre_px.size(); ++row) {
    const auto x = static_cast<double>(row);
    const double paper_column = steps.paper_centre_px[row];
    paper.push_back({x, paper_column < width ? width - paper_column : kNan});
    const bool has_line = steps.centre_sigma_px[row] > 0;
    found.push_back({x, has_line ? width - static_cast<double>(steps.centre_px[row]) : kNan});
    seen.push_back(paper.back().y);
    seen.push_back(found.back().y);
  }
  const LegendEntry legend[] = {{"weighted mean (Abbott's paper)",
                                 LegendEntry::Mark::kLine,
                                 {.color = kVermilion, .width_px = 2, .dash_px = {5, 3}}},
                                {"line found by the response eye (bar: 95 %)",
                                 LegendEntry::Mark::kLine,
                                 {.color = kBlue, .width_px = 2}}};
  const double width_px = canvas.width_px();
  const double below_legend = DrawLegend(canvas, {12, top + 16}, width_px - 24, legend);
  const Range rows{0, std::max(1.0, static_cast<double>(steps.crop.height - 1))};
  Plot plot(canvas, {6, top + below_legend, width_px - 12, kSectionPx - below_legend - 4},
            {"row of the crop (px)", rows, width_px < kFigureWidthPx ? 4 : 8},
            {"shift (px)", Padded(RangeOf(seen), 0.12), 5});
  for (std::size_t row = 0; row < found.size(); ++row) {
    if (std::isfinite(found[row].y)) {
      plot.ErrorBar(found[row], kNormal95 * static_cast<double>(steps.centre_sigma_px[row]),
                    {.color = WithAlpha(kBlue, 0.45), .width_px = 1});
    }
  }
  plot.Line(paper, {.color = kVermilion, .width_px = 2, .dash_px = {5, 3}});
  plot.Line(found, {.color = kBlue, .width_px = 2});
}

Canvas Draw(const pa::FrameSteps& steps, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const double pictures_px = PictureRowPx(steps.crop, width_px, broad) * (broad ? 1 : 2);
  Canvas canvas(width_px, pictures_px + kSectionPx);
  DrawPictures(canvas, steps, broad);
  DrawSection(canvas, steps, pictures_px + 4);
  return canvas;
}

}  // namespace

std::optional<Figure> FrameStepsFigure(const ReportInput& input) {
  if (input.scan == nullptr || !input.scan->steps || !Complete(*input.scan->steps)) {
    return std::nullopt;
  }
  const pa::FrameSteps& steps = *input.scan->steps;
  const auto& lines = input.analysis->lines;
  const std::string which =
      steps.line < lines.size()
          ? " of the line at PA " + PressureAdvanceText(lines[steps.line].pressure_advance_s) + " s"
          : "";
  return Figure{
      "frame_steps",
      fmt::format("Frame {}{} on its way to a cross-section: the part of the picture that "
                  "is analysed; dark pixels blacked out; grey and blurred, as the paper "
                  "does; and the laser line found by the response eye. Below, how far "
                  "the line is shifted in each row: the higher the surface, the larger "
                  "the shift. A broken curve means that no laser was found there.",
                  steps.frame, which),
      Draw(steps, kFigureWidthPx),
      2,
      fmt::format("Frame {}{} in four steps, and below it the laser line's shift in each row.",
                  steps.frame, which),
      Draw(steps, kNarrowWidthPx)};
}

}  // namespace trammel::report
