// Draws many taps: their heights in sequence, and over the bed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tap/report/tap_figures.h"

namespace trammel::report {
namespace {

constexpr double kSeriesPx = 380;
constexpr double kMeshPx = 560;

bool IsOutlier(const tap::Ensemble& ensemble, std::size_t tap) {
  return std::binary_search(ensemble.outliers.begin(), ensemble.outliers.end(), tap);
}

/// Returns the mean of the used heights, their origin.
double MeanHeight(std::span<const PlottedTap> taps, const tap::Ensemble& ensemble) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (taps[i].contact.verdict != Verdict::kGood || IsOutlier(ensemble, i)) continue;
    sum += taps[i].contact.contact_mm.value;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

struct SeriesPoint {
  double number = 0;
  double height_um = 0;
  double lo_um = 0;
  double hi_um = 0;
  bool outlier = false;
};

std::vector<SeriesPoint> SeriesOf(std::span<const PlottedTap> taps, const tap::Ensemble& ensemble,
                                  double zero_mm) {
  std::vector<SeriesPoint> series;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const tap::TapAnalysis& contact = taps[i].contact;
    if (contact.verdict != Verdict::kGood) continue;
    series.push_back({static_cast<double>(i + 1), (contact.contact_mm.value - zero_mm) * kUmPerMm,
                      (contact.contact_mm.interval95.lo - zero_mm) * kUmPerMm,
                      (contact.contact_mm.interval95.hi - zero_mm) * kUmPerMm,
                      IsOutlier(ensemble, i)});
  }
  return series;
}

/// @param joined  one place only: from place to place a line would say nothing
void DrawSeries(Plot& plot, const std::vector<SeriesPoint>& series, bool joined) {
  std::vector<DataPoint> path;
  for (const SeriesPoint& point : series) {
    if (joined && !point.outlier) path.push_back({point.number, point.height_um});
  }
  plot.Line(path, {.color = WithAlpha(kNewMethod, 0.4), .width_px = 1});
  for (const SeriesPoint& point : series) {
    const DataPoint bar[] = {{point.number, point.lo_um}, {point.number, point.hi_um}};
    plot.Line(bar, {.color = kNewMethod, .width_px = 1.2});
    plot.Dot({point.number, point.height_um}, 3.5, point.outlier ? kPaper : kNewMethod,
             Stroke{.color = kNewMethod});
  }
}

/// Draws a mark on the axis for each tap without a height.
void DrawRefused(Plot& plot, std::span<const PlottedTap> taps, double y, const Color& color) {
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (taps[i].contact.verdict == Verdict::kGood) continue;
    plot.Dot({static_cast<double>(i + 1), y}, 3.5, color);
  }
}

/// Draws another program's heights of the same series, if several taps have them.
template <class Height>
void DrawOther(Plot& plot, std::span<const PlottedTap> taps, double zero_mm, const Color& color,
               Height&& height_mm) {
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const double height = height_mm(taps[i]);
    if (!std::isfinite(height)) continue;
    plot.Dot({static_cast<double>(i + 1), (height - zero_mm) * kUmPerMm}, 3, std::nullopt,
             Stroke{.color = color, .width_px = 1.4});
  }
}

/// Returns an axis with whole numbers only.
Axis TapAxis(std::size_t taps) {
  Axis axis{"tap", {0.5, static_cast<double>(taps) + 0.5}, 10};
  for (const double tick : NiceTicks(axis.range, 10)) {
    if (tick == std::floor(tick)) axis.fixed.push_back(tick);
  }
  return axis;
}

double OldHeight(const PlottedTap& tap) {
  return tap.two_line.verdict == Verdict::kGood ? tap.two_line.contact_mm.value
                                                : tap::Recording::kUnknown;
}

double PrinterHeight(const PlottedTap& tap) {
  return tap.recording.firmware_z_mm.value_or(tap::Recording::kUnknown);
}

/// Returns the printer's mean height above ours: it may use another point of the tap, so that only
/// the scatter about the mean compares. 0 without any.
double PrinterOffset(std::span<const PlottedTap> taps) {
  double sum = 0;
  double count = 0;
  for (const PlottedTap& tap : taps) {
    if (tap.contact.verdict != Verdict::kGood || !std::isfinite(PrinterHeight(tap))) continue;
    sum += PrinterHeight(tap) - tap.contact.contact_mm.value;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

std::string SeriesTitle(const tap::Ensemble& ensemble, double zero_mm) {
  if (!std::isfinite(ensemble.standard_deviation_mm)) {
    return fmt::format("Contact height, from {:.4f} mm", zero_mm);
  }
  return fmt::format("{} standard deviation {:.2f} µm, range {:.2f} µm",
                     ensemble.places.size() > 1 ? "About each place's mean:" : "Taps'",
                     ensemble.standard_deviation_mm * kUmPerMm, ensemble.range_mm * kUmPerMm);
}

Canvas DrawTaps(std::span<const PlottedTap> taps, const tap::Ensemble& ensemble, double width_px) {
  const double zero_mm = MeanHeight(taps, ensemble);
  const std::vector<SeriesPoint> series = SeriesOf(taps, ensemble, zero_mm);
  std::vector<double> heights;
  for (const SeriesPoint& point : series) {
    heights.push_back(point.lo_um);
    heights.push_back(point.hi_um);
  }
  const double printer_offset_mm = PrinterOffset(taps);
  bool old = false;
  bool printer = false;
  for (const PlottedTap& tap : taps) {
    heights.push_back((OldHeight(tap) - zero_mm) * kUmPerMm);
    old = old || std::isfinite(heights.back());
    heights.push_back((PrinterHeight(tap) - printer_offset_mm - zero_mm) * kUmPerMm);
    printer = printer || std::isfinite(heights.back());
  }
  const bool banded = ensemble.places.size() == 1 && std::isfinite(ensemble.standard_deviation_mm);
  const double band_um = kNormal95 * ensemble.standard_deviation_mm * kUmPerMm;
  if (banded) {
    heights.push_back(band_um);
    heights.push_back(-band_um);
  }
  using Mark = LegendEntry::Mark;
  std::vector<LegendEntry> legend = {
      {"contact, with its 95 % interval", Mark::kDot, {.color = kNewMethod}}};
  if (!ensemble.outliers.empty()) {
    legend.push_back({"outlier", Mark::kHollowDot, {.color = kNewMethod}});
  }
  if (old) legend.push_back({"two-line", Mark::kHollowDot, {.color = kOldMethod}});
  if (printer) {
    legend.push_back({fmt::format("printer's own, less {:+.1f} µm", printer_offset_mm * kUmPerMm),
                      Mark::kHollowDot,
                      {.color = kBlue}});
  }
  if (series.size() < taps.size()) legend.push_back({"no height", Mark::kDot, {.color = kMuted}});
  if (banded)
    legend.push_back({"95 % of the taps", Mark::kPatch, {.color = WithAlpha(kNewMethod, 0.12)}});
  Canvas canvas(width_px, kSeriesPx);
  const double top = 8 + DrawLegend(canvas, {12, 20}, width_px - 24, legend);
  const Axis axis = TapAxis(taps.size());
  const Range shown = Padded(RangeOf(heights), 0.08);
  Plot plot(canvas, {6, top, width_px - 12, kSeriesPx - top - 4}, axis,
            {fmt::format("height from {:.4f} mm (µm)", zero_mm), shown},
            SeriesTitle(ensemble, zero_mm));
  if (banded) {
    const DataPoint lower[] = {{axis.range.lo, -band_um}, {axis.range.hi, -band_um}};
    const DataPoint upper[] = {{axis.range.lo, band_um}, {axis.range.hi, band_um}};
    plot.Band(lower, upper, WithAlpha(kNewMethod, 0.12));
  }
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  DrawOther(plot, taps, zero_mm, kOldMethod, OldHeight);
  DrawOther(plot, taps, zero_mm + printer_offset_mm, kBlue, PrinterHeight);
  DrawRefused(plot, taps, shown.lo + 0.02 * (shown.hi - shown.lo), kMuted);
  DrawSeries(plot, series, ensemble.places.size() <= 1);
  return canvas;
}

}  // namespace

std::optional<Figure> SeriesFigure(std::span<const PlottedTap> taps,
                                   const tap::Ensemble& ensemble) {
  if (ensemble.good < 2) return std::nullopt;
  Figure figure{
      "series",
      "The contact's height, tap after tap. Where the intervals are as long as the heights "
      "scatter, the taps know how good they are. A hollow mark lies too far from the "
      "others to belong to them; a grey dot at the bottom is a tap without a height. The printer's "
      "own results are shown without their mean difference from ours, which the legend names.",
      DrawTaps(taps, ensemble, kFigureWidthPx)};
  figure.seen = fmt::format("Contact height of {} taps, one after the other. {}.", taps.size(),
                            SeriesTitle(ensemble, MeanHeight(taps, ensemble)));
  figure.narrow = DrawTaps(taps, ensemble, kNarrowWidthPx);
  return figure;
}

namespace {

/// Returns half the distance of the nearest two places, as the size of a tile.
double TileSize(const std::vector<tap::Place>& places) {
  constexpr std::size_t kMax = 1000;  // number examined: beyond that tiles are dots anyway
  double nearest = std::numeric_limits<double>::infinity();
  const std::size_t count = std::min(places.size(), kMax);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      nearest = std::min(nearest, std::max(std::abs(places[i].x_mm - places[j].x_mm),
                                           std::abs(places[i].y_mm - places[j].y_mm)));
    }
  }
  return std::isfinite(nearest) && nearest > 0 ? nearest : 1;
}

Range Spread(const std::vector<tap::Place>& places, double tap::Place::*axis, double margin) {
  std::vector<double> values;
  for (const tap::Place& place : places) values.push_back(place.*axis);
  const Range range = RangeOf(values);
  return {range.lo - margin, range.hi + margin};
}

/// Returns the rectangle of the bed's shape within the room.
RectPx BedRect(const RectPx& room, const Range& x, const Range& y) {
  const double scale = std::min(room.width / (x.hi - x.lo), room.height / (y.hi - y.lo));
  return {room.x, room.y, scale * (x.hi - x.lo), scale * (y.hi - y.lo)};
}

std::string HeightText(double height_um) { return fmt::format("{:+.1f}", height_um); }

/// Returns the text size at which all heights fit into tiles of this width; 0 if it would be too
/// small.
double HeightTextPx(const Canvas& canvas, const std::vector<double>& heights_um, double tile_px) {
  constexpr double kMaxPx = 12;
  constexpr double kMinPx = 7;
  double size_px = kMaxPx;
  for (const double height_um : heights_um) {
    const TextStyle style{.size_px = kMaxPx};
    size_px = std::min(
        size_px, Fitted(canvas, HeightText(height_um), style, std::max(1.0, tile_px - 4)).size_px);
  }
  return size_px >= kMinPx ? size_px : 0;
}

/// @param text_px  0: no text
void DrawTile(Canvas& canvas, const Plot& plot, const tap::Place& place, double half_mm,
              const Range& heights, double mean_mm, double text_px) {
  const double height_um = (place.z_mm.value - mean_mm) * kUmPerMm;
  const Color color = MapColor((height_um - heights.lo) / (heights.hi - heights.lo));
  const double left = plot.X(place.x_mm - half_mm);
  const double right = plot.X(place.x_mm + half_mm);
  const double top = plot.Y(place.y_mm + half_mm);
  const double bottom = plot.Y(place.y_mm - half_mm);
  canvas.FillRect({left, top, right - left, bottom - top}, color);
  if (text_px <= 0) return;
  canvas.Text({(left + right) / 2, (top + bottom) / 2 + text_px / 3}, HeightText(height_um),
              {.size_px = text_px,
               .color = Lightness(color) > 55 ? kOnLight : kOnDark,
               .align = Align::kMiddle});
}

std::vector<tap::Place> KnownPlaces(const tap::Ensemble& ensemble) {
  std::vector<tap::Place> places;
  for (const tap::Place& place : ensemble.places) {
    if (std::isfinite(place.x_mm) && std::isfinite(place.y_mm)) places.push_back(place);
  }
  return places;
}

Canvas DrawMesh(const std::vector<tap::Place>& places, double width_px) {
  double mean_mm = 0;
  std::vector<double> heights;
  for (const tap::Place& place : places)
    mean_mm += place.z_mm.value / static_cast<double>(places.size());
  for (const tap::Place& place : places) heights.push_back((place.z_mm.value - mean_mm) * kUmPerMm);
  const Range height = RangeOf(heights);
  const double tile = TileSize(places);
  const Range x = Spread(places, &tap::Place::x_mm, tile * 0.6);
  const Range y = Spread(places, &tap::Place::y_mm, tile * 0.6);
  const bool broad = width_px >= kFigureWidthPx;
  const RectPx bed = BedRect(broad ? RectPx{70, 34, width_px - 220, kMeshPx - 90}
                                   : RectPx{54, 52, width_px - 148, kSeriesPx - 108},
                             x, y);
  Canvas canvas(width_px, bed.bottom() + 56);
  Plot plot = Plot::Around(canvas, bed, {"x (mm)", x, broad ? 6 : 4}, {"y (mm)", y});
  const std::string title = "Contact height over the bed";
  const std::string scale =
      fmt::format("from {:.4f} mm (µm); range {:.1f} µm", mean_mm, height.hi - height.lo);
  const TextStyle bold{.size_px = kTitleTextPx, .bold = true};
  canvas.Text({12, 20}, broad ? title + ", " + scale : title, bold);
  if (!broad) canvas.Text({12, 38}, scale, Fitted(canvas, scale, bold, width_px - 24));
  const double text_px = HeightTextPx(canvas, heights, plot.X(tile) - plot.X(0));
  for (const tap::Place& place : places) {
    DrawTile(canvas, plot, place, tile / 2, height, mean_mm, text_px);
  }
  DrawColorBar(canvas, {bed.right() + 24, bed.y, 18, bed.height}, height, "height (µm)");
  return canvas;
}

}  // namespace

std::optional<Figure> MeshFigure(const tap::Ensemble& ensemble) {
  const std::vector<tap::Place> places = KnownPlaces(ensemble);
  if (places.size() < 3) return std::nullopt;
  Figure figure{"mesh",
                "Each square is a place that was tapped, with its height above the mean of all. "
                "Nothing is drawn between them: there nothing was measured.",
                DrawMesh(places, kFigureWidthPx)};
  const auto [low, high] = std::minmax_element(
      places.begin(), places.end(),
      [](const tap::Place& a, const tap::Place& b) { return a.z_mm.value < b.z_mm.value; });
  figure.seen = fmt::format(
      "Map of {} tapped places: lowest {:.4f} mm at x {:.0f}, y {:.0f}; highest {:.4f} mm at x "
      "{:.0f}, y {:.0f}.",
      places.size(), low->z_mm.value, low->x_mm, low->y_mm, high->z_mm.value, high->x_mm,
      high->y_mm);
  figure.narrow = DrawMesh(places, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
