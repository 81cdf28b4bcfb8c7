// The paper's score against pressure advance (figure 17).
#include <fmt/format.h>

#include <cmath>

#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kHeightPx = 330;
constexpr int kCurvePoints = 200;

std::vector<DataPoint> Scores(const pa::Analysis& analysis) {
  std::vector<DataPoint> scores;
  for (std::size_t i = 0; i < analysis.lines.size() && i < analysis.deviation.score_px.size();
       ++i) {
    const auto& score = analysis.deviation.score_px[i];
    if (score && std::isfinite(*score) && std::isfinite(analysis.lines[i].pressure_advance_s)) {
      scores.push_back({analysis.lines[i].pressure_advance_s, *score});
    }
  }
  return scores;
}

std::vector<DataPoint> Curve(const std::vector<double>& cubic, const Range& x) {
  std::vector<DataPoint> curve;
  for (int i = 0; i <= kCurvePoints && cubic.size() == 4; ++i) {
    const double p = x.lo + (x.hi - x.lo) * i / kCurvePoints;
    curve.push_back({p, cubic[0] + p * (cubic[1] + p * (cubic[2] + p * cubic[3]))});
  }
  return curve;
}

bool Finite(const std::optional<double>& value) { return value && std::isfinite(*value); }

Canvas Draw(const pa::Analysis& analysis, const std::vector<DataPoint>& scores, double width_px) {
  std::vector<double> tested;
  std::vector<double> heights = {0};
  for (const DataPoint& score : scores) {
    tested.push_back(score.x);
    heights.push_back(score.y);
  }
  const Range tested_range = RangeOf(tested);
  const Range x = Padded(tested_range, 0.05);
  const Range y = {0, RangeOf(heights).hi * 1.12};
  const bool good = analysis.pressure_advance.good();
  const std::vector<DataPoint> curve = Curve(analysis.deviation.cubic, tested_range);

  Canvas canvas(width_px, kHeightPx);
  std::vector<LegendEntry> legend = {{"line", LegendEntry::Mark::kDot, {.color = kBlue}}};
  if (!curve.empty()) {
    const auto& r_squared = analysis.deviation.r_squared;
    legend.push_back({r_squared ? fmt::format("cubic fit, R² = {:.2f}", *r_squared) : "cubic fit",
                      LegendEntry::Mark::kLine,
                      {.color = kSky, .width_px = 2}});
  }
  const Stroke lowest_stroke{.color = kVermilion, .dash_px = {2, 3}};
  const Stroke minimum_stroke{.dash_px = {5, 4}};
  const bool lowest = good && Finite(analysis.deviation.best_s);
  const bool minimum = good && Finite(analysis.deviation.cubic_minimum_s);
  if (lowest) {
    legend.push_back({fmt::format("lowest score, {:.4f} s", *analysis.deviation.best_s),
                      LegendEntry::Mark::kLine, lowest_stroke});
  }
  if (minimum) {
    legend.push_back(
        {fmt::format("minimum of the cubic, {:.4f} s", *analysis.deviation.cubic_minimum_s),
         LegendEntry::Mark::kLine, minimum_stroke});
  }
  const double below_legend = 4 + DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  Plot plot(canvas, {6, below_legend, width_px - 12, kHeightPx - below_legend - 4},
            {"pressure advance (s)", x, width_px < kFigureWidthPx ? 5 : 8}, {"deviation (px)", y});
  plot.Line(curve, {.color = kSky, .width_px = 2.5});
  if (lowest) {
    plot.VerticalLine(*analysis.deviation.best_s, lowest_stroke);
  }
  if (minimum) {
    plot.VerticalLine(*analysis.deviation.cubic_minimum_s, minimum_stroke);
  }
  for (const DataPoint& score : scores) {
    plot.Dot(score, 4.5, kBlue);
  }
  return canvas;
}

}  // namespace

std::optional<Figure> DeviationFigure(const AnalysisRun& input) {
  const std::vector<DataPoint> scores = Scores(input.analysis);
  if (scores.empty()) return std::nullopt;
  Figure figure{"deviation",
                "The score of Abbott's paper, for comparison: how much the height of each row of a "
                "height map varies along the line, summed over the rows. Low is even. It knows no "
                "sign and rests on the few lines near the bottom, so that its answer scatters more "
                "than the response fit's; a low R² means that the scores follow no curve.",
                Draw(input.analysis, scores, kFigureWidthPx)};
  figure.seen =
      fmt::format("The paper's score of {} lines against their pressure advance.", scores.size());
  figure.narrow = Draw(input.analysis, scores, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
