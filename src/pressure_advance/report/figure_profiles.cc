// Draws the cross-section along every line, stacked like the printed pattern.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr std::size_t kMaxLanes = 30;
constexpr double kLabelPx = 76;

struct Sample {
  double position = 0;
  double relative = 0;  ///< reading over the line's median, less 1
  bool gap = false;
};

struct Lane {
  double pressure_advance_s = 0;
  bool used = false;
  std::vector<Sample> samples;
};

const pa::Seen& Reading(const pa::ProfileSample& sample, bool area) {
  return area ? sample.area : sample.width;
}

Lane MakeLane(const pa::LineProfile& profile, const pa::LineResult& line, bool area) {
  Lane lane{line.pressure_advance_s, line.used, {}};
  std::vector<double> values;
  for (const pa::ProfileSample& sample : profile.samples) {
    const pa::Seen& reading = Reading(sample, area);
    if (!sample.gap && reading.seen() && std::isfinite(reading.value)) {
      values.push_back(reading.value);
    }
  }
  const double median = values.empty() ? 0 : Median(values);
  for (const pa::ProfileSample& sample : profile.samples) {
    const pa::Seen& reading = Reading(sample, area);
    const bool seen = !sample.gap && reading.seen() && std::isfinite(reading.value) && median > 0;
    if (std::isfinite(sample.position)) {
      lane.samples.push_back({sample.position, seen ? reading.value / median - 1 : 0, !seen});
    }
  }
  return lane;
}

/// Computes the value of a lane's half height: nearly the largest deviation of all lines.
double HalfScale(const std::vector<Lane>& lanes) {
  std::vector<double> sizes;
  for (const Lane& lane : lanes) {
    for (const Sample& sample : lane.samples) {
      if (!sample.gap) {
        sizes.push_back(std::abs(sample.relative));
      }
    }
  }
  return sizes.empty() ? 1 : std::clamp(Quantile(sizes, 0.98), 0.1, 1.2);
}

/// Fills from the lane's middle to the readings, as one polygon per stretch without a gap.
void FillStretches(Plot& plot, Canvas& canvas, const Lane& lane, double sign, const Color& color) {
  std::vector<PointPx> outline;
  const auto flush = [&] {
    if (outline.size() > 1) {
      const double middle = plot.Y(0);
      outline.push_back({outline.back().x, middle});
      outline.push_back({outline.front().x, middle});
      canvas.Polygon(outline, color);
    }
    outline.clear();
  };
  for (const Sample& sample : lane.samples) {
    if (sample.gap) {
      flush();
    } else {
      outline.push_back(plot.At({sample.position, sign * std::max(0.0, sign * sample.relative)}));
    }
  }
  flush();
}

void ShadeGaps(Plot& plot, const Lane& lane) {
  for (std::size_t i = 0; i < lane.samples.size(); ++i) {
    if (lane.samples[i].gap) {
      const double before = lane.samples[i > 0 ? i - 1 : i].position;
      const double after = lane.samples[std::min(i + 1, lane.samples.size() - 1)].position;
      const double here = lane.samples[i].position;
      plot.ShadeX({(before + here) / 2, (here + after) / 2}, kUnseen);
    }
  }
}

void DrawLane(Canvas& canvas, const RectPx& outer, const Range& x, double half_scale,
              const pa::Analysis& analysis, const Lane& lane) {
  Plot plot = Plot::Around(canvas, outer, {.label = "", .range = x, .shown = false},
                           {.label = "", .range = {-half_scale, half_scale}, .shown = false});
  plot.ShadeX(
      {analysis.response.acceleration.window_begin, analysis.response.acceleration.window_end},
      WithAlpha(kBlue, 0.10));
  plot.ShadeX(
      {analysis.response.deceleration.window_begin, analysis.response.deceleration.window_end},
      WithAlpha(kVermilion, 0.12));
  ShadeGaps(plot, lane);
  canvas.Clip(plot.inner());
  FillStretches(plot, canvas, lane, 1, lane.used ? kVermilion : WithAlpha(kVermilion, 0.4));
  FillStretches(plot, canvas, lane, -1, lane.used ? kBlue : WithAlpha(kBlue, 0.4));
  canvas.Unclip();
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 0.8});
  canvas.Text({outer.x - 8, plot.Y(0) + 4},
              PressureAdvanceText(lane.pressure_advance_s) + (lane.used ? "" : " ○"),
              {.color = lane.used ? kInk : kMuted, .align = Align::kEnd});
}

std::vector<Lane> Lanes(const pa::Analysis& analysis, bool area) {
  std::vector<Lane> lanes;
  for (const std::size_t i : LinesByPressureAdvance(analysis, kMaxLanes)) {
    if (i < analysis.profiles.size() && !analysis.profiles[i].samples.empty()) {
      lanes.push_back(MakeLane(analysis.profiles[i], analysis.lines[i], area));
    }
  }
  std::reverse(lanes.begin(), lanes.end());  // the highest on top, as on the bed
  return lanes;
}

std::string Caption(bool area, double half_scale, bool all) {
  return fmt::format(
      "Every line by its pressure advance (s, left; ○: not used), from the start of printing on "
      "the "
      "left. Up and orange: {} than the line's median; down and blue: {}; a lane's edge stands for "
      "{:.0f} %. Where pressure advance is too low, a line is starved behind the speed-up (left "
      "shaded window) and overfed at the slow-down (right window); too high, it is the other way "
      "round; right, it is flat. Grey: could not be read.{}",
      area ? "more filament in the cross-section" : "wider", area ? "less" : "narrower",
      half_scale * 100, all ? "" : " Not every line is shown.");
}

struct Content {
  const pa::Analysis* analysis = nullptr;
  std::vector<Lane> lanes;
  Range x;
  bool in_mm = false;
  double half_scale = 1;
};

Canvas Draw(const Content& content, double width_px) {
  const std::vector<Lane>& lanes = content.lanes;
  const double lane_px = lanes.size() <= 12 ? 38 : lanes.size() <= 20 ? 28 : 22;
  const double top = 4;
  const double axis_px = 44;
  Canvas canvas(width_px, top + lane_px * static_cast<double>(lanes.size()) + axis_px);
  const double width = width_px - kLabelPx - 12;
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    const double lane_top = top + lane_px * static_cast<double>(i);
    DrawLane(canvas, {kLabelPx, lane_top + 3, width, lane_px - 6}, content.x, content.half_scale,
             *content.analysis, lanes[i]);
  }
  const char* label =
      content.in_mm ? "position along the line (mm)" : "position along the line (line lengths)";
  (void)Plot::Around(canvas, {kLabelPx, canvas.height_px() - axis_px, width, 1},
                     {label, content.x, width_px < kFigureWidthPx ? 5 : 8},
                     {.label = "", .range = {0, 1}, .shown = false});
  return canvas;
}

}  // namespace

std::optional<Figure> ProfilesFigure(const AnalysisRun& input) {
  const pa::Analysis& analysis = input.analysis;
  const bool area = pa::ChooseReading(analysis.profiles) == pa::Reading::kArea;
  Content content{&analysis, Lanes(analysis, area), {}, false, 1};
  if (content.lanes.empty()) return std::nullopt;
  std::vector<double> positions;
  for (const Lane& lane : content.lanes) {
    for (const Sample& sample : lane.samples) positions.push_back(sample.position);
  }
  content.x = RangeOf(positions);
  content.in_mm = analysis.profiles.front().position_unit == pa::PositionUnit::kMillimetre;
  content.half_scale = HalfScale(content.lanes);
  const bool all = content.lanes.size() >= analysis.profiles.size();
  Figure figure{"profiles", Caption(area, content.half_scale, all), Draw(content, kFigureWidthPx)};
  figure.seen = fmt::format(
      "{} printed lines, one below the other, each with where along it there is more or less "
      "filament than usual; shaded where it speeds up and slows down.",
      content.lanes.size());
  figure.narrow = Draw(content, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
