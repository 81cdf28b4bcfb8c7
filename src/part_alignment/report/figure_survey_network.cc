// A survey's network: what was measured, and from where.
#include <fmt/format.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "document/plot.h"
#include "part_alignment/report/survey_report.h"

namespace trammel::report {
namespace {

using part_alignment::Survey;
using part_alignment::SurveyedTarget;
using part_alignment::SurveyStation;

struct Marks {
  std::vector<DataPoint> coded;
  std::vector<DataPoint> plain;
  std::vector<DataPoint> stations;
};

Marks MarksOf(const Survey& survey, int up) {
  Marks marks;
  for (const SurveyedTarget& target : survey.targets) {
    (target.plain ? marks.plain : marks.coded).push_back({target.at_mm.x(), target.at_mm[up]});
  }
  for (const SurveyStation& station : survey.stations) {
    if (station.used) marks.stations.push_back({station.place_mm.x(), station.place_mm[up]});
  }
  return marks;
}

void DrawPanel(Canvas& canvas, const RectPx& outer, const Survey& survey, int up,
               const std::string& title) {
  const Marks marks = MarksOf(survey, up);
  std::vector<double> x;
  std::vector<double> y;
  for (const auto* points : {&marks.coded, &marks.plain, &marks.stations}) {
    for (const DataPoint& point : *points) {
      x.push_back(point.x);
      y.push_back(point.y);
    }
  }
  constexpr double kAxesPx = 70;
  constexpr double kSpare = 1.08;
  constexpr double kLeast = 1e-3;
  const auto [across, along] = WithOneScale(RangeOf(x), RangeOf(y), outer.width - kAxesPx,
                                            outer.height - kAxesPx, kSpare, kLeast);
  const int ticks = outer.width < kFigureWidthPx / 2 ? 3 : 6;
  Plot plot(canvas, outer, {"x (mm)", across, ticks}, {up == 1 ? "y (mm)" : "z (mm)", along, 5},
            title);
  const double dot = outer.width < kFigureWidthPx / 2 ? 1.6 : 2.2;
  for (const DataPoint& at : marks.stations)
    plot.Dot(at, dot, std::nullopt, Stroke{.color = kGrey, .width_px = 1});
  for (const DataPoint& at : marks.plain) plot.Dot(at, dot, kGreen);
  for (const DataPoint& at : marks.coded) plot.Diamond(at, 1.8 * dot, kBlue);
}

Canvas Draw(const Survey& survey, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const double panel_px = broad ? 400 : 300;
  std::vector<LegendEntry> legend = {
      {"coded targets", LegendEntry::Mark::kDiamond, {.color = kBlue}}};
  if (survey.plain.targets > 0)
    legend.push_back({"plain targets", LegendEntry::Mark::kDot, {.color = kGreen}});
  legend.push_back({"camera", LegendEntry::Mark::kHollowDot, {.color = kGrey, .width_px = 1}});
  Canvas canvas(width_px, 2 * panel_px + 60);
  const double top = 8 + DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  DrawPanel(canvas, {6, top, width_px - 12, panel_px - 6}, survey, 1, "From above");
  DrawPanel(canvas, {6, top + panel_px, width_px - 12, panel_px - 6}, survey, 2, "From the side");
  return canvas;
}

}  // namespace

Figure SurveyNetworkFigure(const Survey& survey) {
  Figure figure{"network",
                "Where targets and camera stood, in the survey's own frame, to one scale. A side "
                "of the part that no camera looks at has no targets, or weak ones.",
                Draw(survey, kFigureWidthPx)};
  figure.seen = fmt::format(
      "The part's targets ({} of them plain) and the camera's places, from above and from the "
      "side.",
      survey.plain.targets);
  figure.narrow = Draw(survey, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
