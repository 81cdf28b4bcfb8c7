// Axes, curves, points and bars on a canvas; the key of a colour scale.
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

/// Of data values. lo < hi where made by the functions below.
struct Range {
  double lo = 0;
  double hi = 1;
};

/// The finite values' range; {0, 1} without any, widened by a little where all are equal.
[[nodiscard]] Range RangeOf(std::span<const double> values);

/// Covers both.
[[nodiscard]] Range Join(const Range& a, const Range& b);

/// Wider on both sides by `fraction` of its width.
[[nodiscard]] Range Padded(const Range& range, double fraction);

/// Ranges about the same middles that have one scale in a rectangle of width_px and height_px.
/// @param spare  of the wider one's scale, > 1 to leave room around it
/// @param least  units per pixel at least, > 0
[[nodiscard]] std::pair<Range, Range> WithOneScale(const Range& x, const Range& y, double width_px,
                                                   double height_px, double spare, double least);

/// Multiples of 1, 2 or 5 times a power of ten within the range, about `wanted` of them (at most
/// 2.5 times as many). REQUIRES range.lo < range.hi, wanted >= 1.
[[nodiscard]] std::vector<double> NiceTicks(const Range& range, int wanted);

/// Labels with just the decimals that tell neighbouring ticks apart; never "-0".
[[nodiscard]] std::vector<std::string> TickLabels(const std::vector<double>& ticks);

struct Axis {
  std::string label;  ///< with its unit
  Range range;
  int ticks = 6;                   ///< about
  bool shown = true;               ///< false: neither ticks nor label
  std::vector<double> fixed = {};  ///< ticks to use instead
};

struct DataPoint {
  double x = 0;
  double y = 0;
};

/// Where its name, and how it was drawn, come in the legend.
struct LegendEntry {
  enum class Mark { kLine, kDot, kHollowDot, kDiamond, kPatch };
  std::string name;
  Mark mark = Mark::kLine;
  Stroke stroke = {};
};

inline constexpr double kTickTextPx = 12;
inline constexpr double kLabelTextPx = 13;
inline constexpr double kTitleTextPx = 14;

/// A rectangle of a canvas with two axes. Draws grid, ticks and labels when made; what follows is
/// clipped to the rectangle; a mark whose middle lies outside is left out. Data values that are not
/// finite are left out.
class Plot {
 public:
  /// @param outer  everything, with labels. REQUIRES ranges with lo < hi.
  /// @param title  above the rectangle, left; may be empty.
  Plot(Canvas& canvas, const RectPx& outer, const Axis& x, const Axis& y,
       const std::string& title = "");

  /// The same with the rectangle that data fill given, so that plots can be lined up; ticks and
  /// labels come outside it.
  [[nodiscard]] static Plot Around(Canvas& canvas, const RectPx& inner, const Axis& x,
                                   const Axis& y, const std::string& title = "");

  /// The rectangle that data fill.
  [[nodiscard]] const RectPx& inner() const { return inner_; }
  [[nodiscard]] double X(double x) const;
  [[nodiscard]] double Y(double y) const;
  [[nodiscard]] PointPx At(const DataPoint& point) const { return {X(point.x), Y(point.y)}; }

  void Line(std::span<const DataPoint> points, const Stroke& stroke);
  /// Between two curves over the same x.
  void Band(std::span<const DataPoint> lower, std::span<const DataPoint> upper, const Color& fill);
  void ShadeX(const Range& range, const Color& fill);
  void VerticalLine(double x, const Stroke& stroke);
  void HorizontalLine(double y, const Stroke& stroke);
  void Dot(const DataPoint& point, double radius_px, const std::optional<Color>& fill,
           const std::optional<Stroke>& edge = std::nullopt);
  void Diamond(const DataPoint& point, double radius_px, const Color& fill);
  /// From y - half to y + half, with caps.
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

/// An arrow with a filled head of at most `head_px`; none where it is shorter than a pixel.
void DrawArrow(Canvas& canvas, const PointPx& from, const PointPx& tip, const Stroke& shaft,
               double head_px);

/// The style, smaller where the text would be wider than `most_px`.
[[nodiscard]] TextStyle Fitted(const Canvas& canvas, std::string_view text, const TextStyle& style,
                               double most_px);

void DrawDiamond(Canvas& canvas, const PointPx& at, double radius_px, const Color& fill);

/// One or more rows of entries from `at` (the first row's baseline). Returns the height used.
double DrawLegend(Canvas& canvas, const PointPx& at, double max_width_px,
                  std::span<const LegendEntry> entries);

/// Values over a grid, row 0 on top. Shape (rows, columns), row-major; NaN: nothing measured, grey.
struct Grid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::vector<double> values;

  [[nodiscard]] double at(std::size_t row, std::size_t column) const {
    return values[row * columns + column];
  }
};

/// The grid as a picture, one pixel per value, in the colours of MapColor over `range`.
[[nodiscard]] Frame ColorGrid(const Grid& grid, const Range& range);

/// A vertical bar of MapColor's colours with ticks on its right and the label beside them.
void DrawColorBar(Canvas& canvas, const RectPx& bar, const Range& range, const std::string& label);

/// 1, 2 or 5 times a power of ten: the largest that does not exceed `most`.
/// REQUIRES `most` finite and > 0.
[[nodiscard]] double RoundedDown(double most);

/// A bar as long as a round value is drawn, and that value behind it: "0.02 px". Clear of text
/// whose baseline is `at`.
/// @param at           left end, on the text's baseline
/// @param px_per_unit  px of the canvas per unit of the value, finite and > 0
/// @param most_px      that the bar may be long
/// @return  the right end of the text
double DrawScaleKey(Canvas& canvas, const PointPx& at, double px_per_unit, double most_px,
                    const std::string& unit, const Stroke& stroke);

}  // namespace trammel::report
