// Axes, curves, points and bars on a canvas; legend of a colour scale.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "document/canvas.h"

namespace trammel::report {

/// Range of data values; lo < hi if made by the functions below.
struct Range {
  double lo = 0;
  double hi = 1;
};

/// Returns the range of the finite values; {0, 1} without any, slightly widened if all are equal.
[[nodiscard]] Range RangeOf(std::span<const double> values);

/// Covers both ranges.
[[nodiscard]] Range Join(const Range& a, const Range& b);

/// Widens a range on both sides by `fraction` of its width.
[[nodiscard]] Range Padded(const Range& range, double fraction);

/// Returns ranges about the same centres with equal scale in a rectangle of width_px and height_px.
/// @param spare  factor on the larger scale, > 1 for a margin
/// @param least  minimum units per pixel, > 0
[[nodiscard]] std::pair<Range, Range> WithOneScale(const Range& x, const Range& y, double width_px,
                                                   double height_px, double spare, double least);

/// Returns multiples of 1, 2 or 5 times a power of ten within the range, about `wanted` of them (at
/// most 2.5 times as many). REQUIRES range.lo < range.hi, wanted >= 1.
[[nodiscard]] std::vector<double> NiceTicks(const Range& range, int wanted);

/// Returns labels with just the decimals that distinguish neighbouring ticks; never "-0".
[[nodiscard]] std::vector<std::string> TickLabels(const std::vector<double>& ticks);

struct Axis {
  std::string label;  ///< with unit
  Range range;
  int ticks = 6;                   ///< about
  bool shown = true;               ///< false: neither ticks nor label
  std::vector<double> fixed = {};  ///< ticks to use instead
};

struct DataPoint {
  double x = 0;
  double y = 0;
};

/// Name and mark of a series in the legend.
struct LegendEntry {
  enum class Mark { kLine, kDot, kHollowDot, kDiamond, kPatch };
  std::string name;
  Mark mark = Mark::kLine;
  Stroke stroke = {};
};

inline constexpr double kTickTextPx = 12;
inline constexpr double kLabelTextPx = 13;
inline constexpr double kTitleTextPx = 14;

/// Rectangle of a canvas with two axes. Construction draws grid, ticks and labels; later drawing is
/// clipped to the rectangle. Omits markers whose centre is outside, and data values that are not
/// finite.
class Plot {
 public:
  /// @param outer  everything, with labels. REQUIRES ranges with lo < hi.
  /// @param title  above the rectangle, left; may be empty.
  Plot(Canvas& canvas, const RectPx& outer, const Axis& x, const Axis& y,
       const std::string& title = "");

  /// Creates a plot from the data rectangle, so that plots can be aligned; ticks and labels are
  /// outside it.
  [[nodiscard]] static Plot Around(Canvas& canvas, const RectPx& inner, const Axis& x,
                                   const Axis& y, const std::string& title = "");

  /// Returns the data rectangle.
  [[nodiscard]] const RectPx& inner() const { return inner_; }
  [[nodiscard]] double X(double x) const;
  [[nodiscard]] double Y(double y) const;
  [[nodiscard]] PointPx At(const DataPoint& point) const { return {X(point.x), Y(point.y)}; }

  void Line(std::span<const DataPoint> points, const Stroke& stroke);
  /// Fills the area between two curves over the same x.
  void Band(std::span<const DataPoint> lower, std::span<const DataPoint> upper, const Color& fill);
  void ShadeX(const Range& range, const Color& fill);
  void VerticalLine(double x, const Stroke& stroke);
  void HorizontalLine(double y, const Stroke& stroke);
  void Dot(const DataPoint& point, double radius_px, const std::optional<Color>& fill,
           const std::optional<Stroke>& edge = std::nullopt);
  void Diamond(const DataPoint& point, double radius_px, const Color& fill);
  /// Draws a bar from y - half to y + half, with caps.
  void ErrorBar(const DataPoint& point, double half, const Stroke& stroke);

 private:
  Plot(Canvas& canvas, const Axis& x, const Axis& y);
  void Draw(const Axis& x, const Axis& y, const std::string& title);
  void DrawXAxis(const Axis& axis);
  void DrawYAxis(const Axis& axis);
  [[nodiscard]] bool Holds(const PointPx& point) const;

  Canvas* canvas_;
  RectPx inner_;
  Range x_range_;
  Range y_range_;
};

/// Draws an arrow with a filled head of at most `head_px`; nothing if it is shorter than a pixel.
void DrawArrow(Canvas& canvas, const PointPx& from, const PointPx& tip, const Stroke& shaft,
               double head_px);

/// Returns the style, smaller if the text would be wider than `most_px`.
[[nodiscard]] TextStyle Fitted(const Canvas& canvas, std::string_view text, const TextStyle& style,
                               double max_px);

void DrawDiamond(Canvas& canvas, const PointPx& at, double radius_px, const Color& fill);

/// Draws one or more rows of entries from `at` (the first row's baseline). Returns the height used.
double DrawLegend(Canvas& canvas, const PointPx& at, double max_width_px,
                  std::span<const LegendEntry> entries);

/// Values over a grid, row 0 at the top. Shape (rows, columns), row-major; NaN: not measured, grey.
struct Grid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::vector<double> values;

  [[nodiscard]] double at(std::size_t row, std::size_t column) const {
    return values[row * columns + column];
  }
};

/// Returns the grid as a picture, one pixel per value, in the colours of MapColor over `range`.
[[nodiscard]] Frame ColorGrid(const Grid& grid, const Range& range);

/// Draws a vertical bar of MapColor's colours with ticks on its right and the label beside them.
void DrawColorBar(Canvas& canvas, const RectPx& bar, const Range& range, const std::string& label);

/// Returns the largest value <= `most` that is 1, 2 or 5 times a power of ten.
/// REQUIRES `most` finite and > 0.
[[nodiscard]] double RoundedDown(double most);

/// Draws a bar whose length is a round value, followed by that value: "0.02 px". Clear of text
/// whose baseline is `at`.
/// @param at           left end, on the text's baseline
/// @param px_per_unit  px of the canvas per unit of the value, finite and > 0
/// @param most_px      maximum length of the bar
/// @return  the right end of the text
double DrawScaleKey(Canvas& canvas, const PointPx& at, double px_per_unit, double max_px,
                    const std::string& unit, const Stroke& stroke);

}  // namespace trammel::report
