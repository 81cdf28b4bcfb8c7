// Figure of each line's error in pressure advance, against it: the origin of the answer.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;
constexpr double kHeightPx = 400;

struct Reading {
  double pressure_advance_s = 0;
  double surplus_ms = 0;
  double sigma_ms = 0;  ///< 0: not used
  double fitted_ms = 0;
};

/// Lists readings by rising pressure advance; omits a line that was never measured (all zero).
std::vector<Reading> Readings(const pa::Analysis& analysis, const pa::TransitionResult& result) {
  std::vector<Reading> readings;
  const std::size_t count = std::min({analysis.lines.size(), result.surplus_s.size(),
                                      result.sigma_s.size(), result.fitted_s.size()});
  for (std::size_t i = 0; i < count; ++i) {
    const Reading reading{analysis.lines[i].pressure_advance_s, result.surplus_s[i] * kMsPerS,
                          result.sigma_s[i] * kMsPerS, result.fitted_s[i] * kMsPerS};
    const bool measured = reading.surplus_ms != 0 || reading.sigma_ms > 0 || reading.fitted_ms != 0;
    if (measured && std::isfinite(reading.pressure_advance_s) &&
        std::isfinite(reading.surplus_ms) && std::isfinite(reading.sigma_ms) &&
        std::isfinite(reading.fitted_ms)) {
      readings.push_back(reading);
    }
  }
  std::stable_sort(readings.begin(), readings.end(), [](const Reading& a, const Reading& b) {
    return a.pressure_advance_s < b.pressure_advance_s;
  });
  return readings;
}

/// Computes the range of the used, the fit and zero; unused may be outside.
Range SurplusRange(const std::vector<Reading>& readings) {
  std::vector<double> values = {0};
  for (const Reading& reading : readings) {
    if (reading.sigma_ms > 0) {
      values.push_back(reading.surplus_ms - kNormal95 * reading.sigma_ms);
      values.push_back(reading.surplus_ms + kNormal95 * reading.sigma_ms);
      values.push_back(reading.fitted_ms);
    }
  }
  return RangeOf(values);
}

struct Panel {
  const pa::TransitionResult* result = nullptr;
  std::vector<Reading> readings;
  std::string title;
  std::string too_low;   ///< the line's appearance there if its value is too low
  std::string too_high;  ///< and too high
  Color color;
};

void DrawReading(Plot& plot, const Range& y, const Reading& reading, const Color& color) {
  constexpr double kRadiusPx = 4;
  const DataPoint at{reading.pressure_advance_s, std::clamp(reading.surplus_ms, y.lo, y.hi)};
  if (reading.sigma_ms > 0) {
    plot.ErrorBar({at.x, reading.surplus_ms}, kNormal95 * reading.sigma_ms,
                  {.color = color, .width_px = 1});
    plot.Dot(at, kRadiusPx, color);
  } else {
    plot.Dot(at, kRadiusPx, kPaper, Stroke{.color = color});
  }
}

/// Explains values above and below zero at this speed change.
void DrawMeaning(Canvas& canvas, const Plot& plot, const Panel& panel) {
  const TextStyle style{.size_px = 11, .color = kMuted, .align = Align::kEnd};
  const RectPx& inner = plot.inner();
  const double zero = plot.Y(0);
  const double room = inner.width - 10;
  const auto words = [&](double baseline, const std::string& text) {
    const TextStyle fitted = Fitted(canvas, text, style, room);
    const double width = canvas.TextWidth(text, fitted);
    canvas.FillRect({inner.right() - 8 - width, baseline - 11, width + 6, 15},
                    WithAlpha(kPaper, 0.85));
    canvas.Text({inner.right() - 5, baseline}, text, fitted);
  };
  constexpr double kMin_px = 18;
  if (zero - inner.y > kMin_px) words(inner.y + 14, "above 0: " + panel.too_low);
  if (inner.bottom() - zero > kMin_px) words(inner.bottom() - 7, "below 0: " + panel.too_high);
}

void DrawPanel(Canvas& canvas, const RectPx& outer, const Range& x, const Range& y,
               const Measured& answer, const Panel& panel) {
  const Measured& own = panel.result->pressure_advance;
  const bool shown = answer.good() && own.good();
  std::string title = panel.title;
  if (shown) {
    const Quantity& quantity = own.quantity();
    title += ": " + ValueText(quantity.value, quantity.interval95, kSeconds) + " alone";
  }
  Plot plot(canvas, outer, {"printed with this pressure advance (s)", x, 5},
            {"PA too low by (ms)", y}, title);
  if (shown) {
    const Interval& interval = own.quantity().interval95;
    plot.ShadeX({interval.lo, interval.hi}, WithAlpha(panel.color, 0.18));
  }
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  if (answer.good()) {
    plot.VerticalLine(answer.quantity().value, {.width_px = 1.5, .dash_px = {5, 4}});
  }
  std::vector<DataPoint> fit;
  for (const Reading& reading : panel.readings) {
    fit.push_back({reading.pressure_advance_s, reading.fitted_ms});
  }
  plot.Line(fit, {.color = panel.color, .width_px = 2});
  for (const Reading& reading : panel.readings) {
    DrawReading(plot, y, reading, panel.color);
  }
  if (shown) plot.Diamond({own.quantity().value, 0}, 6, kInk);
  DrawMeaning(canvas, plot, panel);
}

/// The legend names the sources of the answer's line, which may be outside both diamonds.
std::vector<LegendEntry> Legend(const Measured& answer, const char* name) {
  std::vector<LegendEntry> legend = {
      {"line (bar: 95 %)", LegendEntry::Mark::kDot, {.color = kMuted}},
      {"line not used", LegendEntry::Mark::kHollowDot, {.color = kMuted}},
      {"fit", LegendEntry::Mark::kLine, {.color = kMuted, .width_px = 2}}};
  if (answer.good()) {
    legend.push_back({"where the fit crosses 0", LegendEntry::Mark::kDiamond, {.color = kInk}});
    legend.push_back({"its 95 % interval", LegendEntry::Mark::kPatch, {.color = kGrid}});
    legend.push_back({name, LegendEntry::Mark::kLine, {.dash_px = {5, 4}}});
  }
  return legend;
}

struct Content {
  std::vector<Panel> panels;
  Range x;
  Range y;
  const Measured* answer = nullptr;
  const char* answer_name = "answer of both";
};

/// Draws panels side by side, or below each other if there is no room.
Canvas Draw(const Content& content, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const double panel_px = broad ? 350 : 280;
  const auto panels = static_cast<double>(content.panels.size());
  const double panel_width = broad ? width_px / panels : width_px;
  Canvas measure(width_px, 1);
  const auto legend = Legend(*content.answer, content.answer_name);
  const double top = 8 + DrawLegend(measure, {12, 20}, width_px - 24, legend);
  Canvas canvas(width_px, top + (broad ? 1 : panels) * panel_px + 4);
  DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  for (std::size_t i = 0; i < content.panels.size(); ++i) {
    const auto number = static_cast<double>(i);
    DrawPanel(canvas,
              {(broad ? number * panel_width : 0) + 4, top + (broad ? 0 : number * panel_px),
               panel_width - 8, panel_px - 10},
              content.x, content.y, *content.answer, content.panels[i]);
  }
  return canvas;
}

std::string Seen(const Content& content) {
  std::string text = content.panels.size() == 1 ? "A plot, one dot per corner"
                                                : "Two plots, one dot per printed line";
  text +=
      ": by how much its pressure advance was too low, against the pressure advance it was printed "
      "with.";
  for (const Panel& panel : content.panels) {
    const Measured& own = panel.result->pressure_advance;
    if (panel.readings.empty()) continue;
    text +=
        fmt::format(" {}: from {:+.0f} ms at {:.4f} s to {:+.0f} ms at {:.4f} s", panel.title,
                    panel.readings.front().surplus_ms, panel.readings.front().pressure_advance_s,
                    panel.readings.back().surplus_ms, panel.readings.back().pressure_advance_s);
    if (content.answer->good() && own.good()) {
      text += "; the fit crosses zero at " + WithInterval(own.quantity(), kSeconds);
    }
    text += ".";
  }
  return text;
}

}  // namespace

std::optional<Figure> ResponseFigure(const AnalysisRun& input) {
  const pa::Analysis& analysis = input.analysis;
  const pa::ResponseResult& response = analysis.response;
  Content content;
  content.answer = &analysis.pressure_advance;
  if (response.law && response.law->weight > 0) {
    content.answer_name = "answer, by the shape of the lines too";
  }
  if (analysis.corners) content.answer_name = "answer";
  const auto add = [&](const pa::TransitionResult& result, const char* title, const char* too_low,
                       const char* too_high, const Color& color) {
    content.panels.push_back(
        {&result, Readings(analysis, result), title, too_low, too_high, color});
  };
  if (analysis.corners) {
    add(analysis.corners->response, "Corners", "too much filament at the corner (PA too low)",
        "too little (PA too high)", kVermilion);
  } else {
    add(response.acceleration, "Speeding up", "too little filament on the line (PA too low)",
        "too much (PA too high)", kBlue);
    add(response.deceleration, "Slowing down", "too much filament on the line (PA too low)",
        "too little (PA too high)", kVermilion);
  }
  std::vector<double> tested;
  for (const Panel& panel : content.panels) {
    for (const Reading& reading : panel.readings) tested.push_back(reading.pressure_advance_s);
  }
  if (tested.empty()) return std::nullopt;
  content.x = Padded(RangeOf(tested), 0.05);
  Range surplus = SurplusRange(content.panels.front().readings);
  for (const Panel& panel : content.panels) surplus = Join(surplus, SurplusRange(panel.readings));
  content.y = Padded(surplus, 0.14);
  constexpr const char* kOfCorners =
      "Each dot is one printed corner: the time by which its pressure advance was too low (above "
      "0) "
      "or too high (below 0), read from the filament around the corner. A value that is too low "
      "leaves too much of it, one that is too high too little. The right pressure advance is where "
      "the fit crosses 0. Towards the right the curve may flatten: a gap in the filament cannot "
      "get "
      "emptier than empty.";
  Figure figure{"response",
                analysis.corners ? kOfCorners
                                 : "Each dot is one printed line: the time by which its pressure "
                                   "advance was too low (above 0) "
                                   "or too high (below 0), read from the filament that the change "
                                   "of speed took from the line "
                                   "or left on it. Where the nozzle begins to speed up, a value "
                                   "that is too low leaves too "
                                   "little filament; where it begins to slow down, too much. The "
                                   "right pressure advance is "
                                   "where the fit crosses 0. Towards the right the curve may "
                                   "flatten: a gap in the filament "
                                   "cannot get emptier than empty.",
                Draw(content, kFigureWidthPx)};
  figure.seen = Seen(content);
  figure.narrow = Draw(content, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
