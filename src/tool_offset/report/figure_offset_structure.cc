// One structure: its teeth as located on the scan, and what became of them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_style.h"
#include "tool_offset/report/sheet_picture.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

constexpr double kSidePx = 8;
constexpr double kRowGapPx = 10;
constexpr double kPlotPx = 190;
constexpr double kPlotLeftPx = 70;  // the same for all, so that teeth stand above each other
constexpr double kPlotTopPx = 26;   // for the title
constexpr double kPlotGapPx = 14;   // to what comes below

/// What all parts of the figure need.
struct Shown {
  const PageView& page;
  const to::SheetPlan& plan;
  const to::PageMap& map;
  const to::Structure& structure;
  const to::StructureReading& reading;
  bool is_x = true;
  double half_mm = 0;   ///< of what is shown along the measured axis
  double outer_mm = 0;  ///< from the middle line to the far end of a leg
  double inner_mm = 0;  ///< and to the end that reaches into the other comb
  bool broad = true;    ///< not for a phone
};

std::string SlugOf(const std::string& name) {
  std::string slug = "structure-";
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') slug += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) slug += c;
    if (c == '+') slug += "-plus";
    if (c == '-') slug += "-minus";
    if (c == ' ') slug += '-';
  }
  return slug;
}

to::PagePoint LegPlace(const Shown& shown, const to::LocalMap& local,
                       const to::FingerReading& finger, std::size_t leg, double along_leg_mm) {
  const double mean_mm = (finger.legs[0].position_mm + finger.legs[1].position_mm) / 2;
  const double beside_mm =
      finger.legs[leg].position_mm - mean_mm + finger.legs[leg].slope * along_leg_mm;
  const to::PagePoint& axis_px = shown.is_x ? local.u_px_mm : local.v_px_mm;
  const to::PagePoint& leg_px = shown.is_x ? local.v_px_mm : local.u_px_mm;
  return finger.place + beside_mm * axis_px + along_leg_mm * leg_px;
}

/// From where to where a comb's legs run, from the structure's middle line.
std::array<double, 2> LegEnds_mm(const Shown& shown, std::size_t comb) {
  const to::SheetPoint& shift = shown.reading.shift_mm[comb];
  const to::SheetPoint& programmed = shown.structure.combs[comb].programmed;
  const double across_mm = shown.is_x ? shift.v_mm + programmed.v_mm : shift.u_mm + programmed.u_mm;
  if (shown.structure.FromLowSide(comb))
    return {-shown.outer_mm + across_mm, shown.inner_mm + across_mm};
  return {-shown.inner_mm + across_mm, shown.outer_mm + across_mm};
}

void DrawFinger(Canvas& canvas, const Shown& shown, const PageWindow& window,
                const to::LocalMap& local, const to::FingerReading& finger) {
  const bool used = finger.left_out.empty();
  const std::array<double, 2> ends_mm = LegEnds_mm(shown, finger.comb);
  const Color& color = kCombColors[finger.comb];
  for (std::size_t leg = 0; leg < 2; ++leg) {
    if (finger.legs[leg].rows_used == 0) continue;
    const PointPx line[] = {window.At(LegPlace(shown, local, finger, leg, ends_mm[0])),
                            window.At(LegPlace(shown, local, finger, leg, ends_mm[1]))};
    HaloLine(canvas, line,
             {.color = color,
              .width_px = 1.3,
              .dash_px = used ? std::vector<double>{} : std::vector<double>{3, 3}});
  }
  const double outside_mm =
      shown.structure.FromLowSide(finger.comb) ? ends_mm[0] - 0.6 : ends_mm[1] + 0.6;
  const to::PagePoint& leg_px = shown.is_x ? local.v_px_mm : local.u_px_mm;
  const PointPx label = window.At(finger.place + outside_mm * leg_px);
  TagText(canvas, label, fmt::format("{}{}", used ? "" : "× ", finger.finger),
          {.size_px = 10.5, .color = used ? color : kInk, .bold = !used});
}

/// The structure in pieces, each a row; returns where the rows end.
double DrawRows(Canvas& canvas, const Shown& shown, int rows, double row_px, double top) {
  constexpr double kFinger_mm = 2;  // more than half of what is drawn of one
  for (int row = 0; row < rows; ++row) {
    const double from_mm = -shown.half_mm + 2 * shown.half_mm * row / rows;
    const double to_mm = from_mm + 2 * shown.half_mm / rows;
    const RectPx rect{kSidePx, top + row * (row_px + kRowGapPx), canvas.width_px() - 2 * kSidePx,
                      row_px};
    const PageWindow window = AlongStructure(shown.map, shown.structure, from_mm, to_mm, rect);
    DrawPage(canvas, shown.page, window);
    canvas.Clip(rect);
    for (const to::FingerReading& finger : shown.reading.fingers) {
      if (finger.place.x_px == 0 && finger.place.y_px == 0) continue;  // beside the page
      const double along_mm = finger.planned_mm + finger.position_mm;
      if (!(along_mm > from_mm - kFinger_mm && along_mm < to_mm + kFinger_mm)) continue;
      const to::LocalMap local =
          shown.map.Near({shown.structure.middle.u_mm + (shown.is_x ? along_mm : 0),
                          shown.structure.middle.v_mm + (shown.is_x ? 0 : along_mm)});
      DrawFinger(canvas, shown, window, local, finger);
    }
    canvas.Unclip();
    canvas.StrokeRect(rect, {.color = kMuted, .width_px = 0.8});
  }
  return top + rows * (row_px + kRowGapPx);
}

/// What data fill of a plot in the room.
RectPx Inner(const RectPx& room) {
  return {kPlotLeftPx, room.y + kPlotTopPx, room.width - kPlotLeftPx - kSidePx,
          room.height - kPlotTopPx - kPlotGapPx};
}

Axis AlongAxis(const Shown& shown) {
  return {fmt::format("along {} from the structure's middle (mm)", shown.is_x ? "u" : "v"),
          {-shown.half_mm, shown.half_mm},
          shown.broad ? 10 : 5};
}

void DrawFingerDot(Plot& plot, const to::FingerReading& finger, double y_um) {
  const Color& color = kCombColors[finger.comb];
  if (finger.comb == 0) {
    plot.Dot({finger.planned_mm, y_um}, 3.2, color);
  } else {
    plot.Dot({finger.planned_mm, y_um}, 3.2, kPaper, Stroke{.color = color, .width_px = 1.6});
  }
}

void DrawResiduals(Canvas& canvas, const Shown& shown, const RectPx& room) {
  std::vector<double> values{-1, 1};
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) values.push_back(finger.residual_mm * kUmPerMm);
  }
  const Range range = Padded(RangeOf(values), 0.15);
  Plot plot =
      Plot::Around(canvas, Inner(room), AlongAxis(shown), {"residual (µm)", range, 5},
                   fmt::format("{}, rms {:.1f} µm; ×: left out",
                               shown.broad ? "What the fit leaves of each tooth" : "What is left",
                               shown.reading.residual_rms_mm * kUmPerMm));
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) {
      DrawFingerDot(plot, finger, finger.residual_mm * kUmPerMm);
      continue;
    }
    Cross(canvas, plot.At({finger.planned_mm, range.lo + 0.08 * (range.hi - range.lo)}), 3.5,
          {.color = kInk, .width_px = 1.6});
  }
}

std::string LeftOutWords(const Shown& shown) {
  std::string text;
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) continue;
    text += fmt::format("{}{}, tooth {}: {}", text.empty() ? " Left out: " : "; ",
                        finger.comb == 0 ? "blue" : "orange", finger.finger, finger.left_out);
  }
  return text.empty() ? " No tooth was left out." : text + ".";
}

std::string Caption(const Shown& shown) {
  if (shown.reading.fingers.empty()) {
    return fmt::format("{}: {}. No teeth were read; the picture shows where they should be.",
                       shown.reading.name, shown.reading.offset_mm.reason());
  }
  std::string text = fmt::format(
      "Blue: comb of {}, read in {}; orange: comb of {}, read in {}. Each coloured line must lie "
      "in "
      "the middle of a printed leg; numbers count the teeth.",
      CombName(shown.structure.combs[0]), shown.reading.channel[0],
      CombName(shown.structure.combs[1]), shown.reading.channel[1]);
  if (!shown.reading.offset_mm.good()) {
    text += fmt::format(" {}: {}.", VerdictWords(shown.reading.offset_mm.verdict()),
                        shown.reading.offset_mm.reason());
  }
  return text + LeftOutWords(shown);
}

std::string NameOf(const Shown& shown) {
  const to::Comb& first = shown.structure.combs[0];
  const to::Comb& second = shown.structure.combs[1];
  // The legs of an original sheet are drawn there and back, its combs one way.
  const char* drawn = shown.plan.original ? "stepped" : "legs";
  return fmt::format("{}: {} ({} {}) minus {} ({} {}) along {}", shown.reading.name,
                     CombName(second), drawn, second.direction > 0 ? "+" : "−", CombName(first),
                     drawn, first.direction > 0 ? "+" : "−", shown.is_x ? "u" : "v");
}

/// In how many rows a structure is shown: as many as keep them at most 40 mm long, on a phone 20,
/// or fewer where that would make the figure too high.
int RowsOf(double half_mm, double half_thickness_mm, double width_px) {
  const double most_row_mm = width_px < kFigureWidthPx ? 20 : 40;
  constexpr double kMostPx = 6000;
  int rows = static_cast<int>(std::ceil(2 * half_mm / most_row_mm));
  const auto height_px = [&](int count) {
    const double px_per_mm = (width_px - 2 * kSidePx) * count / (2 * half_mm);
    return count * (2 * half_thickness_mm * px_per_mm + kRowGapPx);
  };
  while (rows > 1 && height_px(rows) > kMostPx) --rows;
  return rows;
}

Canvas Draw(Shown shown, double width_px) {
  constexpr double kBeside_mm = 1.3;  // room for the teeth's numbers
  constexpr double kBeyond_mm = 0.8;
  shown.broad = width_px >= kFigureWidthPx;
  const double top_px = shown.broad ? 28 : 44;
  const to::SheetSettings& settings = shown.plan.settings;
  shown.half_mm = settings.teeth * settings.pitch_mm / 2 + kBeyond_mm;
  shown.inner_mm = settings.overlap_mm / 2;
  shown.outer_mm = settings.leg_length_mm - shown.inner_mm;
  const int rows = RowsOf(shown.half_mm, shown.outer_mm + kBeside_mm, width_px);
  const double px_per_mm = (width_px - 2 * kSidePx) * rows / (2 * shown.half_mm);
  const double row_px = 2 * (shown.outer_mm + kBeside_mm) * px_per_mm;
  const bool read = !shown.reading.fingers.empty();
  Canvas canvas(width_px, top_px + rows * (row_px + kRowGapPx) + (read ? kPlotPx + 36 : 0));
  const std::string name = NameOf(shown);
  const std::string value = OffsetWords(shown.reading.offset_mm);
  const TextStyle title{.size_px = shown.broad ? 13.5 : 11.5, .bold = true};
  canvas.Text({kSidePx, 18}, shown.broad ? name + ": " + value : name, title);
  if (!shown.broad) canvas.Text({kSidePx, 34}, value, title);
  const double top = DrawRows(canvas, shown, rows, row_px, top_px);
  if (read) {
    DrawResiduals(canvas, shown, {0, top, width_px, kPlotPx});
  }
  return canvas;
}

}  // namespace

Figure StructureFigure(const PageView& page, const to::SheetPlan& plan,
                       const to::SheetResult& result, const to::StructureReading& reading) {
  const to::Structure& structure = plan.structures[reading.structure];
  const to::PageMap& map = result.sheet.map;
  const Shown shown{page, plan, map, structure, reading, structure.axis == to::Axis::kX};
  return {SlugOf(reading.name),
          Caption(shown),
          Draw(shown, kFigureWidthPx),
          2,
          NameOf(shown) + ": " + OffsetWords(reading.offset_mm),
          Draw(shown, kNarrowWidthPx)};
}

}  // namespace trammel::report
