// The law of the lag beside the readings that it was learnt from, and what it says beside the
// changes of speed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/square.h"
#include "base/statistics.h"
#include "document/interval_text.h"
#include "pressure_advance/report/figure_common.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;
constexpr double kRightPx = 14;
constexpr double kLeftPx = 64;
constexpr double kGapPx = 20;  // above what the law leaves over

// A value on the scale of pressure advances, with its name and weight above.
struct Voice {
  std::string name;
  Quantity pressure_advance_s;
  bool answer = false;
};

struct Reading {
  double position_mm = 0;
  double area = 0;
  double sigma = 0;
  double laid = 0;
  bool learnt_from = false;
};

struct Line {
  std::string title;
  std::vector<Reading> readings;
};

struct Content {
  std::vector<Voice> voices;  // none without an answer
  std::vector<Line> lines;
  std::string unit;
  Range x, area, off;
  std::vector<std::pair<double, const char*>> changes;  // of speed, where they begin
};

// The speed changes within the fast stretch: it falls ahead of the stretch's end.
std::vector<std::pair<double, const char*>> ChangesOf(const pa::LineMotion& motion) {
  if (motion.segments.size() != 3 || !motion.length_mm || !motion.acceleration_mm_s2) return {};
  const pa::Segment& before = motion.segments[0];
  const pa::Segment& fast = motion.segments[1];
  const pa::Segment& after = motion.segments[2];
  const double ramp_mm =
      (Square(fast.speed_mm_s) - Square(after.speed_mm_s)) / 2 / *motion.acceleration_mm_s2;
  return {{before.fraction * *motion.length_mm, "speeds up"},
          {(1 - after.fraction) * *motion.length_mm - ramp_mm, "slows down"}};
}

std::string Percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

// What a line's value is beside the answer.
std::string Judged(const pa::Analysis& analysis, double pressure_advance_s) {
  if (!analysis.pressure_advance.good()) return "";
  const Quantity& answer = analysis.pressure_advance.quantity();
  const Interval& interval = answer.interval95;
  if (pressure_advance_s >= interval.lo && pressure_advance_s <= interval.hi) {
    return ": right, as far as can be told";
  }
  const double off_ms = (pressure_advance_s - answer.value) * kMsPerS;
  return fmt::format(": {:.1f} ms too {}", std::abs(off_ms), off_ms < 0 ? "little" : "much");
}

Line LineOf(const pa::Analysis& analysis, const pa::LearntLaw& law, std::size_t i) {
  const double pressure_advance_s = analysis.lines[i].pressure_advance_s;
  Line line{
      "PA " + PressureAdvanceText(pressure_advance_s) + " s" + Judged(analysis, pressure_advance_s),
      {}};
  const auto& samples = analysis.profiles[i].samples;
  for (std::size_t k = 0; k < std::min(samples.size(), law.laid_area[i].size()); ++k) {
    const pa::ProfileSample& sample = samples[k];
    const double laid = law.laid_area[i][k];
    const double all = sample.position + sample.area.value + sample.area.sigma + laid;
    if (sample.gap || !sample.area.seen() || !std::isfinite(all)) continue;
    line.readings.push_back(
        {sample.position, sample.area.value, sample.area.sigma, laid,
         sample.position >= law.learnt_from_mm.lo && sample.position <= law.learnt_from_mm.hi});
  }
  return line;
}

std::vector<Voice> Voices(const pa::Analysis& analysis, const pa::LearntLaw& law) {
  if (!analysis.pressure_advance.good() || !analysis.response.pressure_advance.good()) return {};
  // Of several patterns the answer is their mean: the two weigh in the fit of all lines alone.
  const auto weighed = [&](const std::string& name, const std::string& count, double share) {
    return analysis.repeats ? name : name + ", " + count + " " + Percent(share);
  };
  return {{"Answer", analysis.response.pressure_advance.quantity(), true},
          {weighed("Shape of the lines", "counts", law.weight), law.pressure_advance_s},
          {weighed("Changes of speed", "count", 1 - law.weight), law.crossings_s}};
}

void SetRanges(Content& content) {
  std::vector<double> positions, areas{0}, off{0};
  for (const Line& line : content.lines) {
    for (const Reading& reading : line.readings) {
      positions.push_back(reading.position_mm);
      areas.push_back(reading.area);
      if (!reading.learnt_from) continue;
      areas.push_back(reading.laid);
      off.push_back(std::abs(reading.area - reading.laid));
      off.push_back(kNormal95 * reading.sigma);
    }
  }
  content.x = RangeOf(positions);
  content.area = {0, RangeOf(areas).hi * 1.05};
  // One blob must not hide what the others leave over.
  const double most = 1.3 * std::max(Quantile(off, 0.95), 0.05 * content.area.hi);
  content.off = {-most, most};
}

/// What each of them says, one below the other over one scale.
void DrawVoices(Canvas& canvas, const RectPx& inner, const Content& content) {
  std::vector<double> ends;
  for (const Voice& voice : content.voices) {
    ends.push_back(voice.pressure_advance_s.interval95.lo);
    ends.push_back(voice.pressure_advance_s.interval95.hi);
  }
  const double rows = static_cast<double>(content.voices.size());
  Plot plot = Plot::Around(canvas, inner, {"pressure advance (s)", Padded(RangeOf(ends), 0.06), 5},
                           {.label = "", .range = {0, rows}, .shown = false});
  const Interval& answer = content.voices.front().pressure_advance_s.interval95;
  plot.ShadeX({answer.lo, answer.hi}, WithAlpha(kBlue, 0.12));
  plot.VerticalLine(content.voices.front().pressure_advance_s.value,
                    {.color = kBlue, .width_px = 1.5, .dash_px = {5, 4}});
  for (std::size_t i = 0; i < content.voices.size(); ++i) {
    const Voice& voice = content.voices[i];
    const Quantity& quantity = voice.pressure_advance_s;
    const double y = rows - static_cast<double>(i) - 0.72;
    const Color color = voice.answer ? kBlue : kInk;
    const DataPoint bar[] = {{quantity.interval95.lo, y}, {quantity.interval95.hi, y}};
    plot.Line(bar, {.color = color, .width_px = 2, .round_ends = true});
    plot.Diamond({quantity.value, y}, voice.answer ? 6 : 5, color);
    const std::string text =
        voice.name + ": " + ValueText(quantity.value, quantity.interval95, kSeconds);
    const TextStyle style = Fitted(
        canvas, text, {.size_px = 12, .color = color, .bold = voice.answer}, inner.width - 8);
    const double baseline = plot.Y(y) - 10;
    canvas.FillRect({inner.x + 2, baseline - 11, canvas.TextWidth(text, style) + 6, 15},
                    WithAlpha(kPaper, 0.85));
    canvas.Text({inner.x + 5, baseline}, text, style);
  }
}

/// The law through what it was learnt from, broken where nothing was read.
void DrawLaw(Plot& plot, const Line& line) {
  std::vector<DataPoint> curve;
  for (const Reading& reading : line.readings) {
    if (reading.learnt_from) curve.push_back({reading.position_mm, reading.laid});
  }
  plot.Line(curve, {.color = kVermilion, .width_px = 2});
}

void DrawChanges(Canvas& canvas, Plot& plot, const Content& content, bool named) {
  for (const auto& [at_mm, name] : content.changes) {
    if (!(at_mm > content.x.lo && at_mm < content.x.hi)) continue;
    plot.VerticalLine(at_mm, {.color = kMuted, .width_px = 1, .dash_px = {2, 3}});
    if (named) {
      // Ahead of where a line may swell.
      const double x = plot.X(at_mm);
      const bool room = x - plot.inner().x > 70;
      canvas.Text({x + (room ? -3 : 3), plot.inner().y + 11}, name,
                  {.size_px = 10.5, .color = kMuted, .align = room ? Align::kEnd : Align::kStart});
    }
  }
}

/// What readings have more than the law; a diamond at an edge lies beyond it.
void DrawRest(Plot& plot, const Content& content, const Line& line) {
  constexpr double kRadiusPx = 2.5, kDiamondPx = 4, kInside = 0.9;
  for (const Reading& reading : line.readings) {
    if (!reading.learnt_from) continue;
    const double rest = reading.area - reading.laid;
    const double shown = std::clamp(rest, content.off.lo, content.off.hi);
    if (rest == shown) {
      plot.Dot({reading.position_mm, rest}, kRadiusPx, kInk);
    } else {
      plot.Diamond({reading.position_mm, kInside * shown}, kDiamondPx, kInk);
    }
  }
}

/// What was not learnt from is hollow.
void DrawReadings(Plot& plot, const Line& line) {
  const double radius_px = line.readings.size() > 60 ? 1.6 : 2.5;
  for (const bool learnt_from : {true, false}) {
    for (const Reading& reading : line.readings) {
      if (reading.learnt_from != learnt_from) continue;
      const DataPoint at{reading.position_mm, reading.area};
      if (learnt_from) {
        plot.Dot(at, radius_px, kInk);
      } else {
        plot.Dot(at, radius_px, kPaper, Stroke{.color = kInk, .width_px = 1});
      }
    }
  }
}

/// How far readings may lie beside the law by their own noise.
void DrawNoise(Plot& plot, const Line& line) {
  std::vector<DataPoint> lower, upper;
  for (const Reading& reading : line.readings) {
    if (!reading.learnt_from) continue;
    lower.push_back({reading.position_mm, -kNormal95 * reading.sigma});
    upper.push_back({reading.position_mm, kNormal95 * reading.sigma});
  }
  plot.Band(lower, upper, kGrid);
}

/// A line's readings with the law, and below what the law leaves over.
void DrawLine(Canvas& canvas, const RectPx& area, double off_px, const Content& content,
              const Line& line, bool first, bool last) {
  Plot plot = Plot::Around(canvas, area, {.label = "", .range = content.x, .shown = false},
                           {"area (" + content.unit + ")", content.area, 4}, line.title);
  DrawChanges(canvas, plot, content, first);
  DrawReadings(plot, line);
  DrawLaw(plot, line);
  const RectPx below{area.x, area.bottom() + kGapPx, area.width, off_px};
  canvas.Text({area.x + 3, below.y - 4}, "read less law (" + content.unit + ")",
              {.size_px = 10.5, .color = kMuted});
  const double tick = NiceTicks({0, content.off.hi}, 2).back();
  Plot off = Plot::Around(
      canvas, below,
      {last ? "position along the line (mm)" : "", content.x, area.width < 400 ? 5 : 8, last},
      {.label = "", .range = content.off, .fixed = {-tick, 0, tick}});
  DrawNoise(off, line);
  DrawChanges(canvas, off, content, false);
  off.HorizontalLine(0, {.color = kVermilion, .width_px = 1.5});
  DrawRest(off, content, line);
}

Canvas Draw(const Content& content, double width_px) {
  constexpr double kVoicePx = 38, kAxisPx = 48, kTitlePx = 28, kAreaPx = 110, kOffPx = 60;
  constexpr double kBlockPx = kTitlePx + kAreaPx + kGapPx + kOffPx;
  const std::vector<LegendEntry> legend = {
      {"area as read", LegendEntry::Mark::kDot, {.color = kInk}},
      {"not learnt from", LegendEntry::Mark::kHollowDot, {.color = kInk}},
      {"as the law lays it", LegendEntry::Mark::kLine, {.color = kVermilion, .width_px = 2}},
      {"noise of a reading, 95 %", LegendEntry::Mark::kPatch, {.color = kGrid}}};
  const double voices_px =
      content.voices.empty() ? 0 : kVoicePx * static_cast<double>(content.voices.size()) + kAxisPx;
  Canvas measure(width_px, 1);
  const double legend_px = DrawLegend(measure, {12, 20}, width_px - 24, legend);
  const double top = 8 + voices_px + legend_px;
  Canvas canvas(width_px, top + kBlockPx * static_cast<double>(content.lines.size()) + kAxisPx);
  const double width = width_px - kLeftPx - kRightPx;
  if (!content.voices.empty()) {
    DrawVoices(canvas, {kLeftPx, 8, width, voices_px - kAxisPx}, content);
  }
  DrawLegend(canvas, {12, voices_px + 20}, width_px - 24, legend);
  for (std::size_t i = 0; i < content.lines.size(); ++i) {
    const double at = top + kBlockPx * static_cast<double>(i) + kTitlePx;
    DrawLine(canvas, {kLeftPx, at, width, kAreaPx}, kOffPx, content, content.lines[i], i == 0,
             i + 1 == content.lines.size());
  }
  return canvas;
}

std::string Seen(const Content& content) {
  std::string text;
  for (const Voice& voice : content.voices) {
    text += voice.name + ": " + WithInterval(voice.pressure_advance_s, kSeconds) + ". ";
  }
  text += "Area along printed lines as read, with the curve of the learnt law through it";
  for (std::size_t i = 0; i < content.lines.size(); ++i) {
    text += (i == 0 ? ": " : "; ") + content.lines[i].title;
  }
  return text + ".";
}

std::string Caption(bool answer) {
  const std::string rest =
      " Under each line, what is read less the law (a diamond at an edge lies beyond it): about 0 "
      "where the law holds. Each line's own lag and flow are in it; waves that all lines have "
      "alike would speak against the law.";
  if (!answer) return "Three lines with what an extruder that lags as was learnt lays." + rest;
  return "Two ways to the same value, each with its 95 % interval, and what they come to: how "
         "whole "
         "lines swell and thin, and how much filament the changes of speed move in all. Below, "
         "three lines with what an extruder that lags as was learnt lays: too little pressure "
         "advance starves a line where it speeds up and lets it swell where it slows down; too "
         "much, the other way round." +
         rest;
}

}  // namespace

std::optional<Figure> LawFigure(const ReportInput& input) {
  const pa::Analysis& analysis = *input.analysis;
  if (!analysis.response.law) return std::nullopt;
  const pa::LearntLaw& law = *analysis.response.law;
  Content content;
  for (const std::size_t i : TellingLines(analysis)) {
    if (i >= analysis.profiles.size() || i >= law.laid_area.size()) continue;
    Line line = LineOf(analysis, law, i);
    if (!line.readings.empty()) content.lines.push_back(std::move(line));
  }
  if (content.lines.empty()) return std::nullopt;
  content.voices = Voices(analysis, law);
  const bool in_mm =
      analysis.profiles.front().cross_section_unit == pa::CrossSectionUnit::kMillimetre;
  content.unit = in_mm ? "mm²" : "px²";
  SetRanges(content);
  content.changes = ChangesOf(analysis.motion);
  Figure figure{"law", Caption(!content.voices.empty()) + ScaleWords(analysis),
                Draw(content, kFigureWidthPx)};
  figure.seen = Seen(content);
  figure.narrow = Draw(content, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
