// Draws one tap: its curve, its break, the residuals of the fit.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "document/plot.h"
#include "tap/report/tap_figures.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"

namespace trammel::report {
namespace {

using tap::Corner;
using tap::FittedForce;
using tap::TapAnalysis;

constexpr double kNan = tap::Recording::kUnknown;
constexpr double kCurvePx = 300;
constexpr double kBreakPx = 310;
constexpr double kResidualPx = 170;
constexpr double kApartPx = 12;  // from a plot to the title below it
/// Maximum number of dots: more only blacken the page.
constexpr std::size_t kMaxDots = 4000;

/// Samples of the pull-back's cruise in the fit.
struct BreakSamples {
  std::vector<double> height_um;  ///< above `zero_mm`
  std::vector<double> force_g;
  std::vector<double> residual_g;  ///< NaN where nothing was fitted
  double zero_mm = 0;
  double tare_g = 0;  ///< already taken off the forces
};

std::size_t StrideFor(std::size_t count) { return 1 + count / kMaxDots; }

double Fitted(const FittedForce& force, double z_mm) {
  double value = force.baseline_g + force.baseline_slope_g_mm * (z_mm - force.break_z_mm);
  const double depth_mm = force.break_z_mm - z_mm;
  if (depth_mm <= 0) return value;
  double power = depth_mm;
  for (const double coefficient : force.press_g) {
    value += coefficient * power;
    power *= depth_mm;
  }
  return value;
}

/// Returns the free cell's reading, the zero of the forces shown. Without a load a cell reads its
/// tare, which is unrelated to the tap. Without a fit: the median of the last fifth.
double Tare(const PlottedTap& tap) {
  if (tap.contact.force.fitted) return tap.contact.force.baseline_g;
  const std::vector<double>& forces = tap.recording.force_g;
  std::vector<double> last;
  for (std::size_t i = forces.size() - forces.size() / 5; i < forces.size(); ++i) {
    if (std::isfinite(forces[i])) last.push_back(forces[i]);
  }
  return last.empty() ? 0 : Quantile(last, 0.5);
}

bool Good(const TapAnalysis& analysis) { return analysis.verdict == Verdict::kGood; }

/// Returns a finite time as origin of displayed times.
double TimeZero(const tap::Recording& recording) {
  for (const double time : recording.time_s) {
    if (std::isfinite(time)) return time;
  }
  return 0;
}

/// Origin of the times and forces shown.
struct Zero {
  double time_s = 0;
  double force_g = 0;
};

void DrawLines(Plot& plot, const TapAnalysis& analysis, const Zero& zero, const Color& color) {
  std::vector<DataPoint> corners;
  for (const tap::Point& point : analysis.Points()) {
    corners.push_back({point.time_s - zero.time_s, point.force_g - zero.force_g});
  }
  plot.Line(corners, {.color = color, .width_px = 1.6});
  for (const DataPoint& corner : corners) {
    plot.Dot(corner, 3.6, kPaper, Stroke{.color = color, .width_px = 1.8});
  }
}

void ShadeMoves(Plot& plot, const tap::TapMotion& motion, double zero_s, const Range& time) {
  const auto shade = [&](double from, double to, const Color& color) {
    const Range shown{std::max(from - zero_s, time.lo), std::min(to - zero_s, time.hi)};
    if (shown.lo < shown.hi) plot.ShadeX(shown, color);
  };
  if (motion.has_approach) {
    shade(motion.approach_start_s, motion.approach_end_s, WithAlpha(kSky, 0.10));
  }
  shade(motion.pull_back_start_s, motion.pull_back_end_s, WithAlpha(kSky, 0.22));
}

/// Returns the range from shortly before the collision to the end: a long way down is irrelevant.
Range ShownTimes(const PlottedTap& tap, const tap::TapMotion* motion, double zero_s) {
  std::vector<double> times;
  for (const double time : tap.recording.time_s) times.push_back(time - zero_s);
  Range shown = RangeOf(times);
  if (motion != nullptr && motion->pull_back_end_s > motion->approach_end_s) {
    const double tap_s = motion->pull_back_end_s - motion->approach_end_s;
    const Range wanted{motion->approach_end_s - 0.5 * tap_s - zero_s,
                       motion->pull_back_end_s + 0.3 * tap_s - zero_s};
    const Range both{std::max(shown.lo, wanted.lo), std::min(shown.hi, wanted.hi)};
    if (both.lo < both.hi) shown = both;
  }
  return shown;
}

void DrawCurve(Canvas& canvas, const RectPx& outer, const PlottedTap& tap,
               const tap::TapMotion* motion) {
  const tap::Recording& recording = tap.recording;
  const double zero_s = TimeZero(recording);
  const Zero zero{zero_s, Tare(tap)};
  const Range time = ShownTimes(tap, motion, zero_s);
  std::vector<double> forces;
  std::vector<DataPoint> samples;
  const std::size_t stride = StrideFor(recording.time_s.size());
  for (std::size_t i = 0; i < recording.time_s.size(); i += stride) {
    const double at_s = recording.time_s[i] - zero_s;
    if (!(at_s >= time.lo && at_s <= time.hi)) continue;
    forces.push_back(recording.force_g[i] - zero.force_g);
    samples.push_back({at_s, forces.back()});
  }
  const Range force = Padded(RangeOf(forces), 0.07);
  Plot plot(canvas, outer, {"time (s)", time, canvas.width_px() < kFigureWidthPx ? 5 : 8},
            {"force (gf)", force}, "Force against time");
  if (motion != nullptr) ShadeMoves(plot, *motion, zero_s, time);
  for (const DataPoint& sample : samples) plot.Dot(sample, 1.5, kSample);
  DrawLines(plot, tap.two_line, zero, kOldMethod);
  if (Good(tap.contact)) {
    plot.VerticalLine(tap.contact.contact_time_s - zero_s,
                      {.color = kNewMethod, .width_px = 1.3, .dash_px = {5, 4}});
    for (const tap::Point& point : tap.contact.Points()) {
      plot.Dot({point.time_s - zero_s, point.force_g - zero.force_g}, 4, kNewMethod);
    }
  }
}

BreakSamples CollectBreak(const PlottedTap& tap, const tap::TapMotion& motion) {
  BreakSamples samples;
  samples.tare_g = Tare(tap);
  samples.zero_mm = Good(tap.contact)    ? tap.contact.contact_mm.value
                    : Good(tap.two_line) ? tap.two_line.contact_mm.value
                                         : motion.halt_z_mm;
  const std::size_t stride = StrideFor(tap.recording.time_s.size());
  for (std::size_t i = 0; i < tap.recording.time_s.size(); i += stride) {
    const double moved_s = tap.recording.time_s[i] - tap.latency_s;
    if (!(moved_s >= motion.cruise_start_s && moved_s <= motion.cruise_end_s)) continue;
    const double z_mm = motion.CruiseZ(moved_s);
    const FittedForce& fit = tap.contact.force;
    const bool fitted = fit.fitted && z_mm >= fit.from_z_mm && z_mm <= fit.to_z_mm;
    samples.height_um.push_back((z_mm - samples.zero_mm) * kUmPerMm);
    samples.force_g.push_back(tap.recording.force_g[i] - samples.tare_g);
    samples.residual_g.push_back(fitted ? tap.recording.force_g[i] - Fitted(fit, z_mm) : kNan);
  }
  return samples;
}

/// Returns the published method's last two lines, in height.
std::vector<DataPoint> OldLines(const TapAnalysis& two_line, const BreakSamples& samples) {
  std::vector<DataPoint> line;
  bool begun = false;
  for (const tap::Point& point : two_line.Points()) {
    begun = begun || point.corner == Corner::kDwellEnd;
    if (begun) {
      line.push_back({(point.z_mm - samples.zero_mm) * kUmPerMm, point.force_g - samples.tare_g});
    }
  }
  return line;
}

std::vector<DataPoint> FitCurve(const FittedForce& fit, const BreakSamples& samples,
                                const Range& shown_um) {
  constexpr int kSteps = 160;
  const double zero_mm = samples.zero_mm;
  std::vector<DataPoint> curve;
  if (!fit.fitted) return curve;
  const double from = std::max(fit.from_z_mm, zero_mm + shown_um.lo / kUmPerMm);
  const double to = std::min(fit.to_z_mm, zero_mm + shown_um.hi / kUmPerMm);
  if (!(from < to)) return curve;
  std::vector<double> heights;
  for (int i = 0; i <= kSteps; ++i) heights.push_back(from + (to - from) * i / kSteps);
  if (fit.break_z_mm > from && fit.break_z_mm < to) heights.push_back(fit.break_z_mm);
  std::sort(heights.begin(), heights.end());
  for (const double z : heights) {
    curve.push_back({(z - zero_mm) * kUmPerMm, Fitted(fit, z) - samples.tare_g});
  }
  return curve;
}

/// Draws the results of both methods, as lines and the band of ours.
void DrawAnswers(Plot& plot, const PlottedTap& tap, double zero_mm) {
  if (Good(tap.contact)) {
    plot.ShadeX({(tap.contact.contact_mm.interval95.lo - zero_mm) * kUmPerMm,
                 (tap.contact.contact_mm.interval95.hi - zero_mm) * kUmPerMm},
                WithAlpha(kNewMethod, 0.18));
    plot.VerticalLine((tap.contact.contact_mm.value - zero_mm) * kUmPerMm,
                      {.color = kNewMethod, .width_px = 1.3});
  }
  if (Good(tap.two_line)) {
    plot.VerticalLine((tap.two_line.contact_mm.value - zero_mm) * kUmPerMm,
                      {.color = kOldMethod, .width_px = 1.3, .dash_px = {5, 4}});
  }
}

struct BreakAxes {
  Range height;
  std::string height_label;
  std::string force_label;
  std::string title;
};

void DrawBreak(Canvas& canvas, const RectPx& outer, const PlottedTap& tap,
               const BreakSamples& samples, const BreakAxes& axes) {
  std::vector<double> forces;
  for (std::size_t i = 0; i < samples.height_um.size(); ++i) {
    const double height = samples.height_um[i];
    if (height >= axes.height.lo && height <= axes.height.hi) forces.push_back(samples.force_g[i]);
  }
  Plot plot(canvas, outer, {axes.height_label, axes.height, 5},
            {axes.force_label, Padded(RangeOf(forces), 0.08)}, axes.title);
  DrawAnswers(plot, tap, samples.zero_mm);
  for (std::size_t i = 0; i < samples.height_um.size(); ++i) {
    plot.Dot({samples.height_um[i], samples.force_g[i]}, 2, kSample);
  }
  plot.Line(OldLines(tap.two_line, samples), {.color = kOldMethod, .width_px = 1.6});
  plot.Line(FitCurve(tap.contact.force, samples, axes.height),
            {.color = kNewMethod, .width_px = 2});
}

/// Returns a range around the results that shows the noise and both methods.
Range CloseUp(const PlottedTap& tap, const BreakSamples& samples, const Range& whole) {
  constexpr double kMin_um = 12;
  double half = kMin_um;
  if (Good(tap.contact)) {
    half = std::max(
        half, 4 * kUmPerMm *
                  (tap.contact.contact_mm.interval95.hi - tap.contact.contact_mm.interval95.lo) /
                  2);
  }
  if (Good(tap.two_line)) {
    half =
        std::max(half, 1.6 * kUmPerMm * std::abs(tap.two_line.contact_mm.value - samples.zero_mm));
  }
  const Range near{std::max(-half, whole.lo), std::min(half, whole.hi)};
  return near.lo < near.hi ? near : whole;
}

void DrawResiduals(Canvas& canvas, const RectPx& outer, const PlottedTap& tap,
                   const BreakSamples& samples, const Range& heights, const std::string& label) {
  const double noise = tap.contact.noise_g;
  std::vector<double> shown = samples.residual_g;
  if (std::isfinite(noise)) {
    shown.push_back(2.5 * noise);
    shown.push_back(-2.5 * noise);
  }
  const std::string title =
      std::isfinite(noise) ? fmt::format("What is left (shaded: 95 % of {:.2f} gf noise)", noise)
                           : "What is left";
  Plot plot(canvas, outer, {label, heights, 8}, {"left (gf)", Padded(RangeOf(shown), 0.08), 4},
            title);
  if (std::isfinite(noise)) {
    const DataPoint lower[] = {{heights.lo, -kNormal95 * noise}, {heights.hi, -kNormal95 * noise}};
    const DataPoint upper[] = {{heights.lo, kNormal95 * noise}, {heights.hi, kNormal95 * noise}};
    plot.Band(lower, upper, WithAlpha(kSample, 0.22));
  }
  DrawAnswers(plot, tap, samples.zero_mm);
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  for (std::size_t i = 0; i < samples.height_um.size(); ++i) {
    plot.Dot({samples.height_um[i], samples.residual_g[i]}, 2, kSample);
  }
}

std::string Answer(const char* name, const TapAnalysis& analysis) {
  if (!Good(analysis)) {
    return fmt::format("{}: {}", name, VerdictText(analysis.verdict));
  }
  return fmt::format("{}: {}", name, WithInterval(analysis.contact_mm, kMillimetres));
}

double DrawHead(Canvas& canvas, const PlottedTap& tap) {
  const LegendEntry legend[] = {
      {"sample", LegendEntry::Mark::kDot, {.color = kSample}},
      {Answer("contact", tap.contact),
       LegendEntry::Mark::kLine,
       {.color = kNewMethod, .width_px = 2}},
      {Answer("two-line", tap.two_line),
       LegendEntry::Mark::kLine,
       {.color = kOldMethod, .width_px = 1.6}},
      {"95 % interval", LegendEntry::Mark::kPatch, {.color = WithAlpha(kNewMethod, 0.18)}},
      {"moving", LegendEntry::Mark::kPatch, {.color = WithAlpha(kSky, 0.22)}}};
  return 8 + DrawLegend(canvas, {12, 20}, canvas.width_px() - 24, legend);
}

constexpr const char* kCaption =
    ". Top: the whole tap; forces are counted from the free cell, blue is where the head moves. In "
    "orange the lines and points of the published decomposition, in green those of trammel's "
    "contact. Middle: force against height while the nozzle is pulled back, counted from the "
    "contact; the nozzle lets go where the press leaves the baseline. Bottom: samples minus fit; a "
    "wave or a bow there would mean that the form of the press is not that of the fit.";

/// Content of the figure, and its height.
struct Content {
  const tap::TapMotion* motion = nullptr;
  BreakSamples samples;
  bool breaks = false;
  bool rest = false;
  bool answered = false;
};

/// Draws side by side, or one below the other if the width is small.
Canvas Draw(const PlottedTap& tap, const Content& content, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  Canvas measure(width_px, 1);
  const double head = DrawHead(measure, tap);
  const bool enlarged = content.breaks && content.answered;
  const double height = head + kCurvePx + (content.breaks ? kBreakPx : 0) +
                        (enlarged && !broad ? kBreakPx : 0) + (content.rest ? kResidualPx : 0) + 4;
  Canvas canvas(width_px, height);
  double top = DrawHead(canvas, tap);
  DrawCurve(canvas, {6, top, width_px - 12, kCurvePx - kApartPx}, tap, content.motion);
  top += kCurvePx;
  if (!content.breaks) return canvas;
  const std::string label =
      content.answered ? "height above the contact (µm)" : "height above the halt (µm)";
  const Range whole = Padded(RangeOf(content.samples.height_um), 0.02);
  // Without an answer there is nothing to enlarge.
  const double left = enlarged && broad ? 0.58 * width_px : width_px - 6;
  DrawBreak(canvas, {6, top, left - 6, kBreakPx - kApartPx}, tap, content.samples,
            {whole, label, "force (gf)", "Force against height"});
  if (enlarged && !broad) top += kBreakPx;
  if (enlarged) {
    const double from = broad ? left : 6;
    DrawBreak(canvas, {from, top, width_px - from - 6, kBreakPx - kApartPx}, tap, content.samples,
              {CloseUp(tap, content.samples, whole), label, broad ? "" : "force (gf)",
               "The same, enlarged"});
  }
  top += kBreakPx;
  if (content.rest) {
    DrawResiduals(canvas, {6, top, width_px - 12, kResidualPx}, tap, content.samples, whole, label);
  }
  return canvas;
}

}  // namespace

Figure TapFigure(const PlottedTap& tap) {
  Content content;
  tap::TapMotion found;
  const bool moves = tap::FindMotion(tap.recording.moves, found).code == tap::FindingCode::kNone;
  content.motion = moves ? &found : nullptr;
  if (moves) content.samples = CollectBreak(tap, found);
  content.breaks = content.samples.height_um.size() > 1;
  content.rest = content.breaks && tap.contact.force.fitted;
  content.answered = Good(tap.contact) || Good(tap.two_line);
  Figure figure{"tap", tap.recording.name + kCaption, Draw(tap, content, kFigureWidthPx)};
  figure.seen =
      fmt::format("Force of one tap against time, and against height around the break. {}. {}.",
                  Answer("contact", tap.contact), Answer("two-line", tap.two_line));
  figure.narrow = Draw(tap, content, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
