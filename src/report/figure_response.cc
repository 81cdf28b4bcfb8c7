// Surplus filament against pressure advance: where the answer comes from.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/figure_common.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;
constexpr double kHeightPx = 400;

struct Reading {
  double pressure_advance_s = 0;
  double excess_ms = 0;
  double sigma_ms = 0;  ///< 0: not used
  double fitted_ms = 0;
};

/// By rising pressure advance; a line that was never measured (all zero) is left out.
std::vector<Reading> Readings(const pa::Analysis& analysis, const pa::TransitionResult& result) {
  std::vector<Reading> readings;
  const std::size_t count = std::min({analysis.lines.size(), result.excess_s.size(),
                                      result.sigma_s.size(), result.fitted_s.size()});
  for (std::size_t i = 0; i < count; ++i) {
    const Reading reading{analysis.lines[i].pressure_advance_s, result.excess_s[i] * kMsPerS,
                          result.sigma_s[i] * kMsPerS, result.fitted_s[i] * kMsPerS};
    const bool measured = reading.excess_ms != 0 || reading.sigma_ms > 0 || reading.fitted_ms != 0;
    if (measured && std::isfinite(reading.pressure_advance_s) && std::isfinite(reading.excess_ms) &&
        std::isfinite(reading.sigma_ms) && std::isfinite(reading.fitted_ms)) {
      readings.push_back(reading);
    }
  }
  std::stable_sort(readings.begin(), readings.end(), [](const Reading& a, const Reading& b) {
    return a.pressure_advance_s < b.pressure_advance_s;
  });
  return readings;
}

/// Of what was used, the fit and zero; unused readings may lie outside.
Range ExcessRange(const std::vector<Reading>& readings) {
  std::vector<double> values = {0};
  for (const Reading& reading : readings) {
    if (reading.sigma_ms > 0) {
      values.push_back(reading.excess_ms - reading.sigma_ms);
      values.push_back(reading.excess_ms + reading.sigma_ms);
      values.push_back(reading.fitted_ms);
    }
  }
  return RangeOf(values);
}

struct Panel {
  const pa::TransitionResult* result = nullptr;
  std::vector<Reading> readings;
  std::string title;
  Color color;
};

void DrawReading(Plot& plot, const Range& y, const Reading& reading, const Color& color) {
  constexpr double kRadiusPx = 4.5;
  const DataPoint at{reading.pressure_advance_s, std::clamp(reading.excess_ms, y.lo, y.hi)};
  if (reading.sigma_ms > 0) {
    plot.ErrorBar({at.x, reading.excess_ms}, reading.sigma_ms, {.color = color});
    plot.Dot(at, kRadiusPx, color);
  } else {
    plot.Dot(at, kRadiusPx, kPaper, Stroke{.color = color});
  }
}

void DrawPanel(Canvas& canvas, const RectPx& outer, const Range& x, const Range& y,
               const Measured& answer, bool answer_is_response, const Panel& panel) {
  const Measured& own = panel.result->pressure_advance;
  std::string title = panel.title;
  if (answer.good() && own.good()) {
    title += fmt::format(" alone: {:.4f} ± {:.4f} s", own.quantity().value,
                         own.quantity().standard_uncertainty);
  }
  Plot plot(canvas, outer, {"pressure advance (s)", x, 5}, {"surplus filament (ms)", y}, title);
  if (answer.good() && own.good()) {
    const Interval& interval = own.quantity().interval95;
    plot.ShadeX({interval.lo, interval.hi}, WithAlpha(panel.color, 0.18));
  }
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  if (answer.good() && answer_is_response) {
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
  if (answer.good() && own.good()) {
    plot.Dot({own.quantity().value, 0}, 5, kPaper, Stroke{.width_px = 2});
  }
}

}  // namespace

std::optional<Figure> ResponseFigure(const ReportInput& input) {
  const pa::Analysis& analysis = *input.analysis;
  const pa::ResponseResult& response = analysis.response;
  const Panel panels[] = {
      {&response.acceleration, Readings(analysis, response.acceleration), "Speeding up", kBlue},
      {&response.deceleration, Readings(analysis, response.deceleration), "Slowing down",
       kVermilion}};
  if (panels[0].readings.empty() && panels[1].readings.empty()) {
    return std::nullopt;
  }
  std::vector<double> tested;
  for (const Panel& panel : panels) {
    for (const Reading& reading : panel.readings) {
      tested.push_back(reading.pressure_advance_s);
    }
  }
  const Range x = Padded(RangeOf(tested), 0.05);
  const Range y =
      Padded(Join(ExcessRange(panels[0].readings), ExcessRange(panels[1].readings)), 0.1);
  const bool by_response = analysis.method == pa::Method::kResponse;

  Canvas canvas(kFigureWidthPx, kHeightPx);
  std::vector<LegendEntry> legend = {
      {"line (bar: 1 σ)", LegendEntry::Mark::kDot, {.color = kMuted}},
      {"line not used", LegendEntry::Mark::kHollowDot, {.color = kMuted}},
      {"fit", LegendEntry::Mark::kLine, {.color = kMuted, .width_px = 2}}};
  if (analysis.pressure_advance.good()) {
    legend.push_back({"95 % interval", LegendEntry::Mark::kPatch, {.color = kGrid}});
    if (by_response) {
      legend.push_back({"answer of both", LegendEntry::Mark::kLine, {.dash_px = {5, 4}}});
    }
  }
  const double below_legend = 8 + DrawLegend(canvas, {12, 20}, kFigureWidthPx - 24, legend);
  const double half = kFigureWidthPx / 2;
  for (std::size_t i = 0; i < 2; ++i) {
    DrawPanel(
        canvas,
        {static_cast<double>(i) * half + 6, below_legend, half - 12, kHeightPx - below_legend - 4},
        x, y, analysis.pressure_advance, by_response, panels[i]);
  }
  return Figure{
      "response",
      "Each dot is one printed line: how much filament it has too much (above 0) or too "
      "little (below 0) at a speed change because of its pressure advance, as the time by "
      "which the value was too low. Left: where the nozzle speeds up; right: where it "
      "slows down. The right pressure advance is where the fit crosses 0. Towards the "
      "right the curve may bend: a gap in the filament cannot get emptier than empty.",
      std::move(canvas), false};
}

}  // namespace trammel::report
