#include "pressure_advance/report/pressure_advance_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "base/check.h"
#include "base/statistics.h"
#include "document/interval_text.h"

namespace trammel::report {

std::vector<Figure> PressureAdvanceFigures(const AnalysisRun& input) {
  std::vector<Figure> figures;
  for (const auto& make :
       {ResponseFigure, ProfilesFigure, PhotoFigure, HeightMapsFigure, DeviationFigure}) {
    if (std::optional<Figure> figure = make(input)) {
      figures.push_back(std::move(*figure));
    }
  }
  return figures;
}

namespace pa = pressure_advance;

std::string PressureAdvanceText(double seconds) {
  std::string text = fmt::format("{:.4f}", seconds);
  if (text.back() == '0') {
    text.pop_back();
  }
  return text;
}

std::vector<std::size_t> LinesByPressureAdvance(const pa::Analysis& analysis, std::size_t most) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    if (std::isfinite(analysis.lines[i].pressure_advance_s)) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return analysis.lines[a].pressure_advance_s < analysis.lines[b].pressure_advance_s;
  });
  if (order.size() <= most || most < 2) {
    return order;
  }
  std::vector<std::size_t> picked;
  for (std::size_t i = 0; i < most; ++i) {
    picked.push_back(order[i * (order.size() - 1) / (most - 1)]);
  }
  return picked;
}

const std::vector<pa::HeightMap>* ShownHeights(const AnalysisRun& input) {
  if (!input.scan) {
    return nullptr;
  }
  const auto& maps = input.scan->heights.empty() ? input.scan->paper_heights : input.scan->heights;
  return maps.empty() ? nullptr : &maps;
}

Grid HeightGrid(const pa::HeightMap& map) {
  if (map.frames == 0 || map.rows == 0 || map.height_px.size() != map.frames * map.rows ||
      map.sigma_px.size() != map.height_px.size()) {
    return {};
  }
  Grid grid{map.frames, map.rows, std::vector<double>(map.height_px.size())};
  for (std::size_t row = 0; row < map.rows; ++row) {
    for (std::size_t frame = 0; frame < map.frames; ++frame) {
      const std::size_t at = map.index(frame, row);
      grid.values[row * map.frames + frame] = map.sigma_px[at] > 0
                                                  ? static_cast<double>(map.height_px[at])
                                                  : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return grid;
}

HeightUnit HeightUnitOf(const AnalysisRun& input) {
  const auto& scale = input.analysis.scale;
  // What the paper's method shows instead does not begin at the plate.
  if (!scale || !input.scan || input.scan->heights.empty()) return {};
  return {scale->height_mm_per_px, "height (mm)"};
}

std::string ScaleWords(const pa::Analysis& analysis) {
  const auto& scale = analysis.scale;
  if (!scale) return "";
  if (!scale->height_share || !scale->area_share) {
    return " How well scale and laser angle are known was not said: trammel pa setup measures "
           "both.";
  }
  return fmt::format(
      " Scale and laser angle leave {:.2g} % of all heights and {:.2g} % of all areas open alike "
      "(half of the 95 % interval); beads may be higher and larger than they are read, by a "
      "quarter "
      "where light enters the filament. Neither moves a pressure advance.",
      100 * kNormal95 * *scale->height_share, 100 * kNormal95 * *scale->area_share);
}

Range HeightRange(const std::vector<pa::HeightMap>& maps) {
  std::vector<double> seen;
  for (const pa::HeightMap& map : maps) {
    for (const double height : HeightGrid(map).values) {
      if (std::isfinite(height)) {
        seen.push_back(height);
      }
    }
  }
  if (seen.empty()) {
    return {0, 1};
  }
  const double ends[] = {Quantile(seen, 0.01), Quantile(seen, 0.99)};
  return RangeOf(ends);
}

MapExtent ExtentOf(const pa::HeightMap& map) {
  if (map.position_mm.size() == map.frames && map.frames >= 2) {
    const Range range = RangeOf(map.position_mm);
    return {range, "position along the line (mm)"};
  }
  return {{0, static_cast<double>(std::max<std::size_t>(1, map.frames))}, "frame"};
}

namespace {

constexpr int kPoints = 400;

/// Speed that a move may have `distance_mm` after (or before) it had `speed_mm_s`.
double Reachable(double speed_mm_s, double distance_mm, double acceleration_mm_s2) {
  return std::sqrt(speed_mm_s * speed_mm_s + 2 * acceleration_mm_s2 * distance_mm);
}

}  // namespace

std::vector<DataPoint> SpeedAlongLine(const pressure_advance::LineMotion& motion, bool in_mm) {
  const auto& segments = motion.segments;
  if (segments.empty() || (in_mm && !motion.length_mm)) {
    return {};
  }
  const bool ramps = motion.length_mm && motion.acceleration_mm_s2;
  const double length = motion.length_mm.value_or(1.0);
  std::vector<DataPoint> curve;
  for (int i = 0; i <= kPoints; ++i) {
    const double at = static_cast<double>(i) / kPoints;
    // The lowest speed that any segment allows here: its own inside, a ramp away from it outside.
    double speed = std::numeric_limits<double>::infinity();
    double begin = 0;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      const double end = k + 1 < segments.size() ? begin + segments[k].fraction : 1.0;
      const bool inside = at >= begin && (at < end || k + 1 == segments.size());
      const double distance_mm = std::max({0.0, begin - at, at - end}) * length;
      if (inside) {
        speed = std::min(speed, segments[k].speed_mm_s);
      } else if (ramps) {
        speed = std::min(
            speed, Reachable(segments[k].speed_mm_s, distance_mm, *motion.acceleration_mm_s2));
      }
      begin = end;
    }
    if (!std::isfinite(speed)) {
      return {};
    }
    curve.push_back({in_mm ? at * length : at, speed});
  }
  return curve;
}

}  // namespace trammel::report
