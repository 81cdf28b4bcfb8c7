#include "app/study/study_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "base/statistics.h"
#include "document/plot.h"

namespace trammel::app {
namespace {

using report::Axis;
using report::Canvas;
using report::DataPoint;
using report::Figure;
using report::LegendEntry;
using report::Plot;
using report::Range;
using report::RectPx;
using report::Stroke;

constexpr double kPanelHeight_px = 190;
constexpr Range kAdvance{-0.003, 0.063};  // s; of the paper's figures, with room for a mark
constexpr int kCurvePoints = 120;
constexpr double kMost_px = 400;  // of a deviation that is shown; the paper's axis ends at 350
constexpr double kBin_s = 0.002;  // of answers that lie between the lines
const Stroke kOurs{.color = report::kBlue, .width_px = 2};
const Stroke kTheirs{.color = report::kVermilion, .width_px = 2, .dash_px = {5, 3}};

struct Panels {
  Axis y;
  std::vector<LegendEntry> legend;
  std::function<void(Plot&, const StudySummary&)> draw;
  std::function<std::string(const StudySummary&)> words;
};

std::string NameOf(const sim::Condition& condition) {
  const std::string plate = condition.plate == sim::Plate::kPei     ? "PEI"
                            : condition.plate == sim::Plate::kMatte ? "matte"
                                                                    : "textured";
  return fmt::format("{}, {}, {}", plate,
                     condition.filament == sim::Filament::kBlack ? "black" : "white",
                     condition.ambient ? "ambient" : "dark");
}

// The paper's order: matte, PEI, textured.
std::vector<const StudySummary*> InPaperOrder(const std::vector<StudySummary>& summaries) {
  std::vector<const StudySummary*> order;
  for (const sim::Plate plate : {sim::Plate::kMatte, sim::Plate::kPei, sim::Plate::kTextured}) {
    for (const StudySummary& summary : summaries) {
      if (summary.condition.plate == plate) order.push_back(&summary);
    }
  }
  return order;
}

Canvas DrawPanels(const std::vector<StudySummary>& summaries, const Panels& panels,
                  double width_px) {
  const std::vector<const StudySummary*> order = InPaperOrder(summaries);
  const std::size_t columns = std::min<std::size_t>(width_px < report::kFigureWidthPx ? 2 : 4,
                                                    std::max<std::size_t>(1, order.size()));
  const std::size_t rows = (order.size() + columns - 1) / columns;
  constexpr double kHead_px = 52;
  Canvas canvas(width_px, kHead_px + kPanelHeight_px * static_cast<double>(rows) + 4);
  DrawLegend(canvas, {12, 18}, width_px - 24, panels.legend);
  const double panel_px = (width_px - 8) / static_cast<double>(columns);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double x = 4 + panel_px * static_cast<double>(i % columns);
    const double y = kHead_px + kPanelHeight_px * static_cast<double>(i / columns);
    const double room_px = panel_px - 8;
    const std::string name = NameOf(order[i]->condition);
    const std::string words = panels.words(*order[i]);
    canvas.Text({x + 4, y}, name, Fitted(canvas, name, {.size_px = 12, .bold = true}, room_px));
    canvas.Text({x + 4, y + 15}, words,
                Fitted(canvas, words, {.size_px = 11, .color = report::kMuted}, room_px));
    Plot plot(canvas, {x, y + 20, panel_px - 6, kPanelHeight_px - 36},
              {"", kAdvance, 4, true, {0, 0.02, 0.04, 0.06}}, panels.y);
    panels.draw(plot, *order[i]);
  }
  return canvas;
}

void Bar(Plot& plot, const Range& x, int count) {
  const std::vector<DataPoint> lower = {{x.lo, 0}, {x.hi, 0}};
  const std::vector<DataPoint> upper = {{x.lo, static_cast<double>(count)},
                                        {x.hi, static_cast<double>(count)}};
  plot.Band(lower, upper, report::kBlue);
}

// How many values lie in bins of this width; bin 0 is centred on 0.
void Histogram(Plot& plot, const std::vector<double>& values, double bin_s) {
  if (!(bin_s > 1e-6)) return;  // no lines, or lines that all have one value
  std::vector<long> bins;
  for (const double value : values) bins.push_back(std::lround(value / bin_s));
  std::sort(bins.begin(), bins.end());
  for (auto at = bins.begin(); at != bins.end();) {
    const auto end = std::upper_bound(at, bins.end(), *at);
    const double middle = static_cast<double>(*at) * bin_s;
    Bar(plot, {middle - 0.42 * bin_s, middle + 0.42 * bin_s}, static_cast<int>(end - at));
    at = end;
  }
}

std::vector<DataPoint> Curve(const std::function<double(double)>& value) {
  constexpr double kLast_s = 0.06;
  std::vector<DataPoint> curve;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double p = kLast_s * i / kCurvePoints;
    curve.push_back({p, value(p)});
  }
  return curve;
}

std::string Digits(const std::optional<double>& value, double scale, int decimals) {
  return value ? fmt::format("{:.{}f}", *value * scale, decimals) : std::string("-");
}

Axis CountAxis(const std::vector<StudySummary>& summaries) {
  std::size_t most = 5;
  for (const StudySummary& summary : summaries) most = std::max(most, summary.scans.size());
  return {"", {0, static_cast<double>(most) * 1.05}, 4};
}

Panels ChosenByDeviation(const std::vector<StudySummary>& summaries) {
  Panels panels;
  panels.y = CountAxis(summaries);
  panels.legend = {{"patterns that chose this line", LegendEntry::Mark::kPatch, kOurs},
                   {"minimum of the paper's cubic", LegendEntry::Mark::kLine, kTheirs}};
  panels.draw = [](Plot& plot, const StudySummary& summary) {
    Histogram(plot, summary.deviation.value_s, summary.step_s);
    plot.VerticalLine(PaperOf(summary.condition).minimum_s, kTheirs);
  };
  panels.words = [](const StudySummary& summary) {
    return fmt::format("scatter {:.1f} ms (paper {:.1f})",
                       1e3 * StandardDeviation(summary.deviation.value_s),
                       1e3 * PaperOf(summary.condition).chosen_sd_s);
  };
  return panels;
}

Panels ChosenByResponse(const std::vector<StudySummary>& summaries) {
  Panels panels;
  panels.y = CountAxis(summaries);
  panels.legend = {{"patterns with this answer (bins of 2 ms)", LegendEntry::Mark::kPatch, kOurs},
                   {"mean truth of the virtual prints", LegendEntry::Mark::kLine, kTheirs}};
  panels.draw = [](Plot& plot, const StudySummary& summary) {
    Histogram(plot, summary.response.value_s, kBin_s);
    std::vector<double> truth;
    for (const StudyScan& scan : summary.scans) truth.push_back(scan.truth_s);
    if (!truth.empty()) plot.VerticalLine(Mean(truth), kTheirs);
  };
  panels.words = [](const StudySummary& summary) {
    return fmt::format("scatter {:.1f} ms, {} of {}", 1e3 * StandardDeviation(summary.error_s),
                       summary.response.value_s.size(), summary.scans.size());
  };
  return panels;
}

Panels DeviationOfLines(const std::vector<StudySummary>& summaries) {
  Panels panels;
  double most = 250;  // the paper's highest cubic, with room
  for (const StudySummary& summary : summaries) {
    for (const auto& score : summary.aggregate.score_px) most = std::max(most, score.value_or(0));
  }
  panels.y = {"", {0, std::min(most * 1.03, kMost_px)}, 4};
  panels.legend = {{"deviation (px) of a line", LegendEntry::Mark::kDot, {.color = report::kSky}},
                   {"cubic", LegendEntry::Mark::kLine, kOurs},
                   {"the paper's cubic", LegendEntry::Mark::kLine, kTheirs}};
  panels.draw = [](Plot& plot, const StudySummary& summary) {
    for (const StudyScan& scan : summary.scans) {
      for (std::size_t i = 0; i < scan.score_px.size(); ++i) {
        if (!scan.score_px[i]) continue;
        plot.Dot({scan.pressure_advances_s[i], *scan.score_px[i]}, 1.6, report::kSky);
      }
    }
    const auto& cubic = summary.aggregate.cubic;
    if (!cubic.empty()) plot.Line(Curve([&](double p) { return CubicAt(cubic, p); }), kOurs);
    const PaperFigures paper = PaperOf(summary.condition);
    const std::vector<double> theirs(paper.cubic.begin(), paper.cubic.end());
    plot.Line(Curve([&](double p) { return CubicAt(theirs, p); }), kTheirs);
  };
  panels.words = [](const StudySummary& summary) {
    const PaperFigures paper = PaperOf(summary.condition);
    return fmt::format("R² {} ({:.2f}), minimum {} ({:.0f}) ms",
                       Digits(summary.aggregate.r_squared, 1, 2), paper.r_squared,
                       Digits(summary.aggregate.cubic_minimum_s, 1e3, 0), 1e3 * paper.minimum_s);
  };
  return panels;
}

Panels ResponseOfLines(const std::vector<StudySummary>& summaries) {
  Panels panels;
  std::vector<double> all_ms;
  for (const StudySummary& summary : summaries) {
    for (const StudyScan& scan : summary.scans) {
      for (const auto& excess : scan.excess_s) {
        if (excess) all_ms.push_back(1e3 * *excess);
      }
    }
  }
  Range range{-40, 50};
  if (!all_ms.empty()) {  // single lines that a defect took far off do not take the scale
    range = report::Join(range, {Quantile(all_ms, 0.005), Quantile(all_ms, 0.995)});
  }
  panels.y = {"", report::Padded(range, 0.03), 4};
  panels.legend = {{"response (ms) of a line", LegendEntry::Mark::kDot, {.color = report::kSky}},
                   {"straight line", LegendEntry::Mark::kLine, kOurs}};
  panels.draw = [](Plot& plot, const StudySummary& summary) {
    plot.HorizontalLine(0, {.color = report::kMuted, .width_px = 1});
    for (const StudyScan& scan : summary.scans) {
      for (std::size_t i = 0; i < scan.excess_s.size(); ++i) {
        if (!scan.excess_s[i]) continue;
        plot.Dot({scan.pressure_advances_s[i], 1e3 * *scan.excess_s[i]}, 1.6, report::kSky);
      }
    }
    if (!summary.line) return;
    plot.Line(
        Curve([&](double p) { return 1e3 * (summary.line->offset_s + summary.line->slope * p); }),
        kOurs);
  };
  panels.words = [](const StudySummary& summary) {
    const auto& line = summary.line;
    return fmt::format("R² {}, zero at {} ms", line ? Digits(line->r_squared, 1, 2) : "-",
                       line ? Digits(line->zero_s, 1e3, 1) : "-");
  };
  return panels;
}

Figure FigureOf(const std::string& name, const std::string& caption, const std::string& seen,
                const std::vector<StudySummary>& summaries, const Panels& panels) {
  Figure figure{name, caption, DrawPanels(summaries, panels, report::kFigureWidthPx)};
  figure.seen = seen;
  figure.narrow = DrawPanels(summaries, panels, report::kNarrowWidthPx);
  return figure;
}

}  // namespace

std::vector<Figure> StudyFigures(const std::vector<StudySummary>& summaries) {
  std::vector<Figure> figures;
  figures.push_back(
      FigureOf("study_16_deviation",
               "How often the paper's score chose each line, over pressure advance (s): after its "
               "figure 16.",
               "Counts of the lines that the deviation score chose, for each condition.", summaries,
               ChosenByDeviation(summaries)));
  figures.push_back(FigureOf(
      "study_17_deviation",
      "The paper's score of every line of every pattern over its pressure advance (s), with the "
      "cubic through all of them, and the paper's own: after its figure 17. In brackets the "
      "paper's numbers. Dots above 400 px are left out.",
      "Deviation of all lines against pressure advance, for each condition.", summaries,
      DeviationOfLines(summaries)));
  figures.push_back(FigureOf(
      "study_16_response",
      "The answers of the response fit over pressure advance (s), on the same frames; counted are "
      "the patterns whose verdict is good.",
      "Counts of the answers of the response fit, for each condition.", summaries,
      ChosenByResponse(summaries)));
  figures.push_back(FigureOf(
      "study_17_response",
      "By how much the pressure advance of every line was too low, read at its acceleration (ms), "
      "over its pressure advance (s), with the straight line through all. Where it crosses 0 the "
      "value is right.",
      "Response of all lines against pressure advance, for each condition.", summaries,
      ResponseOfLines(summaries)));
  return figures;
}

}  // namespace trammel::app
