#include "tool_offset/report/offset_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

struct Arrow {
  int tool = 0;
  DataPoint tip_mm;  ///< relative to its start
  Interval x95_mm;   ///< tip's interval
  Interval y95_mm;
  std::string label;
};

std::vector<Arrow> ArrowsOf(const OffsetAnalysis& analysis) {
  std::vector<Arrow> arrows;
  for (const to::CombinedTool& tool : analysis.combined.tools) {
    if (VerdictOf(tool) != Verdict::kGood) continue;
    const Quantity dx_mm = tool.dx_mm.quantity();
    const Quantity dy_mm = tool.dy_mm.quantity();
    arrows.push_back(
        {tool.tool,
         {dx_mm.value, dy_mm.value},
         dx_mm.interval95,
         dy_mm.interval95,
         fmt::format("T{}: {:+.3f}, {:+.3f} mm", tool.tool, dx_mm.value, dy_mm.value)});
  }
  return arrows;
}

/// Returns both ranges with one scale, around the reference tool and all arrows.
std::pair<Range, Range> EqualRanges(const std::vector<Arrow>& arrows, const RectPx& room) {
  std::vector<double> xs{0};
  std::vector<double> ys{0};
  for (const Arrow& arrow : arrows) {
    for (const double x : {arrow.x95_mm.lo, arrow.x95_mm.hi}) xs.push_back(x);
    for (const double y : {arrow.y95_mm.lo, arrow.y95_mm.hi}) ys.push_back(y);
  }
  constexpr double kMin_mm = 0.01;
  constexpr double kSpare = 1.35;
  return WithOneScale(RangeOf(xs), RangeOf(ys), room.width, room.height, kSpare,
                      kMin_mm / std::min(room.width, room.height));
}

/// Finds a position free of other labels: the wanted one, or as little below it as possible.
PointPx FreePlace(const RectPx& wanted, std::vector<RectPx>& taken) {
  RectPx at = wanted;
  const auto covers = [&at](const RectPx& other) {
    return at.x < other.right() && other.x < at.right() && at.y < other.bottom() &&
           other.y < at.bottom();
  };
  while (std::any_of(taken.begin(), taken.end(), covers)) at.y += 4;
  taken.push_back(at);
  return {at.x, at.bottom() - 4};
}

void DrawLabels(Canvas& canvas, const Plot& plot, const std::vector<Arrow>& arrows,
                const std::string& reference) {
  constexpr double kTallPx = 16;
  const TextStyle style{.size_px = 12, .bold = true};
  std::vector<RectPx> taken;
  // Beyond the arrow's tip, so that it remains visible.
  const auto label = [&](const PointPx& at, const std::string& text, bool below) {
    const double width = canvas.TextWidth(text, style);
    const RectPx& inner = plot.inner();
    const double x = std::clamp(at.x + 9, inner.x + 2, std::max(inner.x, inner.right() - width));
    const PointPx place =
        FreePlace({x, below ? at.y + 5 : at.y - kTallPx - 3, width, kTallPx}, taken);
    canvas.FillRect({place.x - 2, place.y - 12, width + 4, kTallPx}, WithAlpha(kPaper, 0.8));
    canvas.Text(place, text, style);
  };
  label(plot.At({0, 0}), reference, false);
  for (const Arrow& arrow : arrows) {
    label(plot.At(arrow.tip_mm), arrow.label, arrow.tip_mm.y < 0);
  }
}

Canvas Draw(const std::vector<Arrow>& arrows, const std::string& reference, double width_px) {
  constexpr double kLeft = 62;
  constexpr double kTop = 30;
  const double height_px = std::min(420.0, width_px + 40);
  Canvas canvas(width_px, height_px);
  const RectPx inner{kLeft, kTop, width_px - kLeft - 14, height_px - kTop - 48};
  const auto [x, y] = EqualRanges(arrows, inner);
  const int ticks = width_px < kFigureWidthPx ? 4 : 6;
  Plot plot = Plot::Around(canvas, inner, {"dx along the bed's x, to the right (mm)", x, ticks},
                           {"dy along y, to the back (mm)", y, 5}, "Where each tool lands");
  constexpr double kHeadPx = 11;
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  plot.VerticalLine(0, {.color = kMuted, .width_px = 1});
  for (const Arrow& arrow : arrows) {
    const Interval& across = arrow.x95_mm;
    const Interval& along = arrow.y95_mm;
    const PointPx low = plot.At({across.lo, along.lo});
    const PointPx high = plot.At({across.hi, along.hi});
    canvas.FillRect({low.x, high.y, high.x - low.x, low.y - high.y}, WithAlpha(kBlue, 0.35));
    DrawArrow(canvas, plot.At({0, 0}), plot.At(arrow.tip_mm), {.color = kVermilion, .width_px = 2},
              kHeadPx);
  }
  plot.Dot({0, 0}, 5, kBlue);
  DrawLabels(canvas, plot, arrows, reference);
  return canvas;
}

}  // namespace

std::optional<Figure> ToolArrowsFigure(const OffsetAnalysis& analysis) {
  const std::vector<Arrow> arrows = ArrowsOf(analysis);
  if (arrows.empty()) return std::nullopt;
  const std::string reference = fmt::format("T{}", analysis.plan.settings.reference_tool);
  Figure figure{"tools",
                fmt::format("The bed from above. Each arrow runs from where {}'s line lands to "
                            "where the tool's lands for the same command. The blue box at its tip "
                            "is the 95 % interval, often smaller than the arrow's head.",
                            reference),
                Draw(arrows, reference, kFigureWidthPx)};
  figure.seen = fmt::format("Arrows from {}:", reference);
  for (const Arrow& arrow : arrows) {
    figure.seen +=
        fmt::format(" T{} lands {:.3f} mm to the {} and {:.3f} mm to the {};", arrow.tool,
                    std::abs(arrow.tip_mm.x), arrow.tip_mm.x < 0 ? "left" : "right",
                    std::abs(arrow.tip_mm.y), arrow.tip_mm.y < 0 ? "front" : "back");
  }
  figure.seen.back() = '.';
  figure.narrow = Draw(arrows, reference, kNarrowWidthPx);
  return figure;
}

namespace {

/// Value and its interval, relative to the row's zero.
struct Row {
  std::string label;
  std::string words;    ///< text at the right; or why there is no value
  Measured value;       ///< mm
  double zero_mm = 0;   ///< reference value
  bool strong = false;  ///< an answer, not a part of one
};

constexpr double kLabelPx = 150;
constexpr double kWordsPx = 292;
constexpr double kRowPx = 23;
constexpr double kNarrowRowPx = 40;  // words above the bar

Range Reach(const std::vector<Row>& rows) {
  std::vector<double> values{-1, 1};
  for (const Row& row : rows) {
    if (!row.value.good()) continue;
    const Interval& interval = row.value.quantity().interval95;
    values.push_back((interval.lo - row.zero_mm) * kUmPerMm);
    values.push_back((interval.hi - row.zero_mm) * kUmPerMm);
  }
  return Padded(RangeOf(values), 0.06);
}

/// @param y  of the row's middle.
void DrawText(Canvas& canvas, const Row& row, double y) {
  const bool broad = canvas.width_px() >= kFigureWidthPx;
  const TextStyle label{.size_px = broad ? 12.5 : 11.5,
                        .align = broad ? Align::kEnd : Align::kStart,
                        .bold = row.strong};
  const bool good = row.value.good();
  const TextStyle words{
      .size_px = broad ? 12.0 : 10.5, .color = good ? kInk : kVermilion, .bold = !good};
  if (broad) {
    canvas.Text({kLabelPx - 8, y + 4.5}, row.label, label);
    canvas.Text({canvas.width_px() - kWordsPx + 10, y + 4.5}, row.words,
                Fitted(canvas, row.words, words, kWordsPx - 14));
  } else {
    const double label_px = canvas.TextWidth(row.label, label);
    TextStyle right = Fitted(canvas, row.words, words, canvas.width_px() - label_px - 24);
    right.align = Align::kEnd;
    const double words_px = canvas.TextWidth(row.words, right);
    canvas.FillRect({6, y - 17, label_px + 5, 15}, kPaper);
    canvas.FillRect({canvas.width_px() - 10 - words_px, y - 17, words_px + 4, 15}, kPaper);
    canvas.Text({8, y - 6}, row.label, label);
    canvas.Text({canvas.width_px() - 8, y - 6}, row.words, right);
  }
}

void DrawRow(Canvas& canvas, const Plot& plot, const Row& row, double middle_y) {
  const Color color = row.strong ? kVermilion : kBlue;
  DrawText(canvas, row, middle_y);
  const double y = canvas.width_px() >= kFigureWidthPx ? middle_y : middle_y + 8;
  if (!row.value.good()) return;
  const Quantity& quantity = row.value.quantity();
  const auto x = [&](double value_mm) { return plot.X((value_mm - row.zero_mm) * kUmPerMm); };
  const Stroke stroke{.color = color, .width_px = row.strong ? 2.4 : 1.6};
  const double lo = x(quantity.interval95.lo);
  const double hi = x(quantity.interval95.hi);
  const PointPx bar[] = {{lo, y}, {hi, y}};
  canvas.Polyline(bar, stroke);
  for (const double end : {lo, hi}) {
    const PointPx cap[] = {{end, y - 5}, {end, y + 5}};
    canvas.Polyline(cap, stroke);
  }
  const PointPx middle{x(quantity.value), y};
  if (row.strong) {
    canvas.FillRect({middle.x - 4, y - 4, 8, 8}, color);
  } else {
    canvas.Circle(middle, 4, kPaper, stroke);
  }
}

/// Returns the rows that fit into a picture: answers before their parts, in order.
std::vector<Row> Fitting(std::vector<Row> rows, std::string& title) {
  constexpr std::size_t kMax = 200;
  if (rows.size() <= kMax) return rows;
  std::stable_partition(rows.begin(), rows.end(), [](const Row& row) { return row.strong; });
  title += fmt::format(" (the first {} of {}; all are in the JSON)", kMax, rows.size());
  rows.resize(kMax);
  return rows;
}

Canvas DrawTable(const std::vector<Row>& rows, const std::string& title, const std::string& axis,
                 double width_px) {
  constexpr double kTopPx = 30;
  constexpr double kBottomPx = 44;
  const bool broad = width_px >= kFigureWidthPx;
  const double row_px = broad ? kRowPx : kNarrowRowPx;
  const double height = static_cast<double>(rows.size()) * row_px;
  Canvas canvas(width_px, kTopPx + height + kBottomPx);
  const RectPx inner = broad ? RectPx{kLabelPx, kTopPx, width_px - kLabelPx - kWordsPx, height}
                             : RectPx{14, kTopPx, width_px - 28, height};
  Plot plot = Plot::Around(canvas, inner, {axis, Reach(rows), 6}, {"", {0, 1}, 2, false});
  canvas.Text({12, 18}, title,
              Fitted(canvas, title, {.size_px = kTitleTextPx, .bold = true}, width_px - 24));
  plot.VerticalLine(0, {.color = kMuted, .width_px = 1.2});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    DrawRow(canvas, plot, rows[i], kTopPx + (static_cast<double>(i) + 0.5) * row_px);
  }
  return canvas;
}

Figure FigureOf(std::string name, std::string caption, std::vector<Row> all, std::string title,
                const std::string& axis) {
  const std::vector<Row> rows = Fitting(std::move(all), title);
  Figure figure{std::move(name), std::move(caption), DrawTable(rows, title, axis, kFigureWidthPx)};
  figure.seen = title + ".";
  for (const Row& row : rows) figure.seen += fmt::format(" {}: {}.", row.label, row.words);
  figure.narrow = DrawTable(rows, title, axis, kNarrowWidthPx);
  return figure;
}

double Zero(const Measured& measured) { return measured.good() ? measured.quantity().value : 0; }

std::string ScanName(const OffsetAnalysis& analysis, const OffsetScan& scan) {
  const auto number = &scan - analysis.scans.data() + 1;
  return fmt::format("sheet {}, scan {}", scan.sheet, number);
}

void AddTool(const OffsetAnalysis& analysis, const to::CombinedTool& tool, std::vector<Row>& rows) {
  for (const bool is_x : {true, false}) {
    const Measured& answer = is_x ? tool.dx_mm : tool.dy_mm;
    // A tool with one bad axis has no result.
    const bool good = VerdictOf(tool) == Verdict::kGood;
    rows.push_back({fmt::format("T{} {}", tool.tool, is_x ? "dx" : "dy"),
                    good ? OffsetText(answer) : VerdictText(VerdictOf(tool)),
                    good ? answer : Measured::Refused(ReasonOf(tool)), Zero(answer), true});
    if (analysis.scans.size() < 2 || !good) continue;
    for (const OffsetScan& scan : analysis.scans) {
      for (const to::ToolReading& reading : scan.result.tools) {
        if (reading.tool != tool.tool) continue;
        const Measured& value = is_x ? reading.dx_mm : reading.dy_mm;
        rows.push_back({ScanName(analysis, scan), OffsetText(value), value, Zero(answer), false});
      }
    }
  }
}

}  // namespace

std::optional<Figure> ToolScansFigure(const OffsetAnalysis& analysis) {
  if (analysis.combined.tools.empty() || analysis.scans.size() < 2) return std::nullopt;
  std::vector<Row> rows;
  for (const to::CombinedTool& tool : analysis.combined.tools) AddTool(analysis, tool, rows);
  return FigureOf("scans",
                  "What each scan says of each tool by itself, against the answer of all, which "
                  "stands at zero. Bars are 95 % intervals; those of one tool should overlap.",
                  rows, "Each scan by itself", "from the tool's answer (µm)");
}

Figure StructureOffsetsFigure(const OffsetScan& scan) {
  std::vector<Row> rows;
  for (const to::StructureReading& reading : scan.result.structures) {
    const bool shown = reading.offset_mm.good() && reading.expected_mm.has_value();
    rows.push_back({reading.name, OffsetText(reading.offset_mm),
                    shown ? reading.offset_mm : Measured::Refused("no value to compare"),
                    reading.expected_mm.value_or(0), false});
  }
  return FigureOf(
      "structures",
      fmt::format(
          "What each structure says by itself, against what all of them together say of it (zero): "
          "offsets of the tools, play and bias. The bar is the 95 % interval from the scatter of "
          "its own teeth; about one in twenty may miss zero. Chi-square per degree of freedom "
          "{:.2f} "
          "(near 1 where scatter explains all).",
          scan.result.chi_square_per_freedom),
      rows, "Structures against the fit of the whole sheet", "measured minus fitted (µm)");
}

DrawnFigure Drawn(const Figure& figure) { return {figure.name, figure.canvas.ToSvg()}; }

}  // namespace trammel::report
