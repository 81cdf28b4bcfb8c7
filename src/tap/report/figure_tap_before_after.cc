// One tap by the published decomposition, beside the same with a root cause of bad taps switched
// back on.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "document/interval_text.h"
#include "document/page.h"
#include "document/plot.h"
#include "tap/report/tap_figures.h"
#include "tap/report/tap_style.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"

namespace trammel::report {
namespace {

using tap::TapAnalysis;

constexpr double kPanelPx = 260;
constexpr double kApartPx = 12;  // from a plot to the title below it
constexpr double kLeastShown_um = 12;

/// What all panels of a tap share.
struct Shown {
  const PlottedTap* tap = nullptr;
  tap::TapMotion motion;
  double zero_s = 0;   ///< The halt, from which times are counted.
  double zero_mm = 0;  ///< From where heights are counted.
  double zero_g = 0;   ///< And forces: what the free cell reads.
  Range time;
  std::string height_label;
};

bool Good(const TapAnalysis& analysis) { return analysis.verdict == Verdict::kGood; }

std::string AnswerOf(const TapAnalysis& analysis) {
  if (Good(analysis)) {
    return WithInterval(analysis.contact_z_mm, analysis.interval95_mm, kMillimetres);
  }
  return VerdictWords(analysis.verdict);
}

std::string TitleOf(const RootCause& cause, const TapAnalysis& published) {
  if (!Good(cause.analysis) || !Good(published)) {
    return fmt::format("{}: {}", cause.name, AnswerOf(cause.analysis));
  }
  return fmt::format("{}: contact {:+.2f} µm", cause.name,
                     (cause.analysis.contact_z_mm - published.contact_z_mm) * kUmPerMm);
}

/// Lines and corners of a method; hollow where they come from the root cause, so that both are seen
/// where they agree.
void DrawCorners(Plot& plot, std::span<const DataPoint> corners, const Color& color, bool hollow) {
  plot.Line(corners, {.color = color, .width_px = hollow ? 2.2 : 1.4});
  for (const DataPoint& corner : corners) {
    plot.Dot(corner, hollow ? 5 : 2.8, hollow ? std::nullopt : std::optional(color),
             Stroke{.color = color, .width_px = 1.6});
  }
}

std::vector<DataPoint> CornersInTime(const Shown& shown, const TapAnalysis& analysis) {
  std::vector<DataPoint> corners;
  for (const tap::Point& point : analysis.Points()) {
    corners.push_back({point.time_s - shown.zero_s, point.force_g - shown.zero_g});
  }
  return corners;
}

/// Those of the pull-back: the approach passes the same heights.
std::vector<DataPoint> CornersInHeight(const Shown& shown, const TapAnalysis& analysis) {
  std::vector<DataPoint> corners;
  for (const tap::Point& point : analysis.Points()) {
    if (point.corner < tap::Corner::kDwellEnd) continue;
    const double z_mm = shown.motion.Z(point.time_s - shown.tap->latency_s);
    corners.push_back({(z_mm - shown.zero_mm) * kUmPerMm, point.force_g - shown.zero_g});
  }
  return corners;
}

Range ForcesWithin(const Shown& shown, const Range& time) {
  std::vector<double> forces;
  const tap::Recording& recording = shown.tap->recording;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    const double at_s = recording.time_s[i] - shown.zero_s;
    if (at_s >= time.lo && at_s <= time.hi) forces.push_back(recording.force_g[i] - shown.zero_g);
  }
  return Padded(RangeOf(forces), 0.1);
}

void DrawWhole(Canvas& canvas, const RectPx& outer, const Shown& shown, const RootCause& cause) {
  Plot plot(canvas, outer, {"time since the halt (s)", shown.time, 5},
            {"force (gf)", ForcesWithin(shown, shown.time), 5},
            TitleOf(cause, shown.tap->two_line));
  plot.ShadeX(
      {shown.motion.pull_back_start_s - shown.zero_s, shown.motion.pull_back_end_s - shown.zero_s},
      WithAlpha(kSky, 0.22));
  const tap::Recording& recording = shown.tap->recording;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    plot.Dot({recording.time_s[i] - shown.zero_s, recording.force_g[i] - shown.zero_g}, 1.4,
             kSample);
  }
  DrawCorners(plot, CornersInTime(shown, cause.analysis), kOldMethod, true);
  DrawCorners(plot, CornersInTime(shown, shown.tap->two_line), kNewMethod, false);
}

/// Of both answers, with room for the samples around them.
Range NearAnswers(const Shown& shown, const RootCause& cause) {
  const tap::TapMotion& motion = shown.motion;
  Range near{-kLeastShown_um, kLeastShown_um};
  if (Good(cause.analysis)) {
    const double off_um = (cause.analysis.contact_z_mm - shown.zero_mm) * kUmPerMm;
    near = {std::min(near.lo, 1.5 * off_um), std::max(near.hi, 1.5 * off_um)};
  }
  const Range moved{(motion.halt_z_mm - shown.zero_mm) * kUmPerMm,
                    (motion.end_z_mm - shown.zero_mm) * kUmPerMm};
  const Range both{std::max(near.lo, moved.lo), std::min(near.hi, moved.hi)};
  return both.lo < both.hi ? both : near;
}

void DrawBreak(Canvas& canvas, const RectPx& outer, const Shown& shown, const RootCause& cause) {
  const tap::Recording& recording = shown.tap->recording;
  const Range near = NearAnswers(shown, cause);
  const tap::TapMotion& motion = shown.motion;
  const auto seconds_at = [&](double height_um) {
    return motion.CruiseTime(shown.zero_mm + height_um / kUmPerMm) + shown.tap->latency_s -
           shown.zero_s;
  };
  Plot plot(canvas, outer, {shown.height_label, near, 5},
            {"", ForcesWithin(shown, {seconds_at(near.lo), seconds_at(near.hi)}), 5},
            "Around the break");
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    const double moved_s = recording.time_s[i] - shown.tap->latency_s;
    if (!(moved_s >= motion.pull_back_start_s && moved_s <= motion.pull_back_end_s)) continue;
    plot.Dot({(motion.Z(moved_s) - shown.zero_mm) * kUmPerMm, recording.force_g[i] - shown.zero_g},
             2.2, kSample);
  }
  DrawCorners(plot, CornersInHeight(shown, cause.analysis), kOldMethod, true);
  DrawCorners(plot, CornersInHeight(shown, shown.tap->two_line), kNewMethod, false);
}

/// From shortly before the collision to the pull-back's end.
Range TimesOf(const tap::TapMotion& motion) {
  const double tap_s = motion.pull_back_end_s - motion.approach_end_s;
  const bool sound = motion.has_approach && tap_s > 0;
  const double from_s = sound ? -0.4 * tap_s : motion.pull_back_start_s - motion.pull_back_end_s;
  const double to_s =
      motion.pull_back_end_s - (sound ? motion.approach_end_s : motion.pull_back_start_s);
  return {from_s, std::max(to_s * 1.05, from_s + 1e-6)};
}

/// A row for each root cause; where there is no room, its two panels below each other.
Canvas Draw(const Shown& shown, double width_px) {
  const PlottedTap& tap = *shown.tap;
  const bool broad = width_px >= kFigureWidthPx;
  const LegendEntry legend[] = {
      {"sample", LegendEntry::Mark::kDot, {.color = kSample}},
      {"published: " + AnswerOf(tap.two_line),
       LegendEntry::Mark::kLine,
       {.color = kNewMethod, .width_px = 2}},
      {"with the root cause", LegendEntry::Mark::kLine, {.color = kOldMethod, .width_px = 2.2}},
      {"pull-back", LegendEntry::Mark::kPatch, {.color = WithAlpha(kSky, 0.22)}}};
  Canvas measure(width_px, 1);
  const auto panels = static_cast<double>(tap.root_causes.size()) * (broad ? 1 : 2);
  double top = 8 + DrawLegend(measure, {12, 20}, width_px - 24, legend);
  Canvas canvas(width_px, top + panels * kPanelPx + 4);
  DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  const double left = broad ? 0.58 * width_px : width_px - 6;
  for (const RootCause& cause : tap.root_causes) {
    DrawWhole(canvas, {6, top, left - 6, kPanelPx - kApartPx}, shown, cause);
    if (!broad) top += kPanelPx;
    const double from = broad ? left : 6;
    DrawBreak(canvas, {from, top, width_px - from - 6, kPanelPx - kApartPx}, shown, cause);
    top += kPanelPx;
  }
  return canvas;
}

}  // namespace

std::optional<Figure> BeforeAfterFigure(const PlottedTap& tap) {
  Shown shown{&tap, {}, 0, 0, 0, {}, {}};
  tap::TapMotion& motion = shown.motion;
  const bool moves = tap::FindMotion(tap.recording.moves, motion).code == tap::FindingCode::kNone;
  if (!moves || tap.root_causes.empty()) return std::nullopt;
  shown.time = TimesOf(motion);
  shown.zero_s = motion.has_approach ? motion.approach_end_s : motion.pull_back_start_s;
  const bool answered = Good(tap.two_line);
  shown.zero_mm = answered ? tap.two_line.contact_z_mm : motion.halt_z_mm;
  shown.height_label =
      answered ? "height above the published contact (µm)" : "height above the halt (µm)";
  if (tap.contact.force.fitted) shown.zero_g = tap.contact.force.baseline_g;
  Figure figure{
      "before-after",
      tap.recording.name +
          ". The published decomposition (green) beside the same with one root cause of "
          "bad taps switched back on (orange), and by how much that moves its contact. Then the "
          "same around the break, where the last two lines cross. trammel's contact is another "
          "method and is not shown here.",
      Draw(shown, kFigureWidthPx)};
  figure.seen = "The published decomposition of one tap, " + AnswerOf(tap.two_line) +
                ", beside the same with a root cause of bad taps switched back on.";
  for (const RootCause& cause : tap.root_causes) {
    figure.seen += " " + TitleOf(cause, tap.two_line) + ".";
  }
  figure.narrow = Draw(shown, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
