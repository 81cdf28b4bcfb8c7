#include "document/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "document/figure.h"

namespace trammel::report {
namespace {

/// From (along, across, height), each 0 … 1, to the canvas. Isometric in spirit: parallel edges
/// stay parallel, the axes' lengths are chosen for a long and narrow relief.
struct Projection {
  PointPx origin;
  PointPx along;
  PointPx across;
  double height_px = 0;

  [[nodiscard]] PointPx operator()(double u, double v, double h) const {
    return {origin.x + u * along.x + v * across.x,
            origin.y + u * along.y + v * across.y - h * height_px};
  }
};

Projection Fit(const RectPx& outer) {
  constexpr double kLabelRoomPx = 46;
  const double width = outer.width - 2 * kLabelRoomPx;
  const double height = outer.height - kLabelRoomPx;
  const PointPx along{0.80 * width, 0.26 * height};
  const PointPx across{0.20 * width, -0.40 * height};
  return {{outer.x + kLabelRoomPx, outer.y + 0.66 * height}, along, across, 0.26 * height};
}

/// 1 facing the light, less on slopes that turn away from it. Slopes in full heights per cell.
double Shade(double slope_along, double slope_across) {
  constexpr double kSteepness = 2.5;
  const double x = kSteepness * slope_along;
  const double y = kSteepness * slope_across;
  const double facing = (1 + 0.5 * x - 0.6 * y) / std::sqrt(1 + x * x + y * y);
  return std::clamp(0.62 + 0.38 * facing, 0.45, 1.0);
}

Color Darkened(const Color& color, double factor) {
  return {color.red * factor, color.green * factor, color.blue * factor};
}

/// The cut face of the relief at its right end, over the floor.
template <class Height>
void DrawEnd(Canvas& canvas, const Projection& project, const Grid& grid, const Height& height) {
  if (grid.rows < 2 || grid.columns < 2) {
    return;
  }
  std::vector<PointPx> face = {project(1, 1, 0)};
  for (std::size_t row = 0; row < grid.rows; ++row) {
    const double across = 1 - static_cast<double>(row) / static_cast<double>(grid.rows - 1);
    const double h = height(row, grid.columns - 1);
    face.push_back(project(1, across, std::isfinite(h) ? std::max(h, 0.0) : 0.0));
  }
  face.push_back(project(1, 0, 0));
  canvas.Polygon(face, kUnseen, Stroke{.color = kMuted, .width_px = 0.8});
}

void DrawFloor(Canvas& canvas, const Projection& project) {
  const std::array<PointPx, 4> floor = {project(0, 0, 0), project(1, 0, 0), project(1, 1, 0),
                                        project(0, 1, 0)};
  canvas.Polygon(floor, WithAlpha(kGrid, 0.4), Stroke{.color = kGrid, .width_px = 1});
}

void DrawTicks(Canvas& canvas, const Projection& project, const SurfaceAxes& axes) {
  const bool broad = canvas.width_px() >= kFigureWidthPx;
  const TextStyle text{.size_px = kTickTextPx, .color = kMuted};
  const Stroke thin{.color = kMuted, .width_px = 1};
  const std::vector<double> along = NiceTicks(axes.along_range, broad ? 8 : 4);
  const std::vector<std::string> along_labels = TickLabels(along);
  for (std::size_t i = 0; i < along.size(); ++i) {
    const double u = (along[i] - axes.along_range.lo) / (axes.along_range.hi - axes.along_range.lo);
    const PointPx at = project(u, 0, 0);
    const std::array<PointPx, 2> tick = {at, PointPx{at.x - 2, at.y + 4}};
    canvas.Polyline(tick, thin);
    TextStyle centred = text;
    centred.align = Align::kMiddle;
    canvas.Text({at.x - 4, at.y + 17}, along_labels[i], centred);
  }
  const PointPx middle = project(0.5, 0, 0);
  const PointPx end = project(1, 0, 0);
  const PointPx start = project(0, 0, 0);
  canvas.Text({middle.x - 10, middle.y + 37}, axes.along,
              {.size_px = kLabelTextPx,
               .color = kMuted,
               .align = Align::kMiddle,
               .angle_rad = std::atan2(end.y - start.y, end.x - start.x)});
  const std::vector<double> across = NiceTicks(axes.across_range, 3);
  const std::vector<std::string> across_labels = TickLabels(across);
  for (std::size_t i = 0; i < across.size(); ++i) {
    const double v =
        (across[i] - axes.across_range.lo) / (axes.across_range.hi - axes.across_range.lo);
    const PointPx at = project(1, v, 0);
    const std::array<PointPx, 2> tick = {at, PointPx{at.x + 4, at.y + 1}};
    canvas.Polyline(tick, thin);
    canvas.Text({at.x + 7, at.y + 5}, across_labels[i], text);
  }
  const PointPx beside = project(1, 0.5, 0);
  // On a phone the colours' bar stands beside the ticks.
  canvas.Text(broad ? PointPx{beside.x + 32, beside.y + 14} : PointPx{end.x - 4, end.y + 22},
              axes.across, {.size_px = kLabelTextPx, .color = kMuted});
}

}  // namespace

void DrawSurface(Canvas& canvas, const RectPx& outer, const Grid& grid, const SurfaceAxes& axes) {
  TRAMMEL_CHECK(grid.values.size() == grid.rows * grid.columns, "{} values for {} x {}",
                grid.values.size(), grid.rows, grid.columns);
  const Projection project = Fit(outer);
  DrawFloor(canvas, project);
  DrawTicks(canvas, project, axes);
  const double span = axes.height_range.hi - axes.height_range.lo;
  const auto height = [&](std::size_t row, std::size_t column) {
    // NaN passes through a clamp.
    return std::clamp((grid.at(row, column) - axes.height_range.lo) / span, -0.1, 1.3);
  };
  // Row 0 of a picture is its upper edge: the far side.
  for (std::size_t row = 0; row + 1 < grid.rows; ++row) {
    const double far = 1 - static_cast<double>(row) / static_cast<double>(grid.rows - 1);
    const double near = 1 - static_cast<double>(row + 1) / static_cast<double>(grid.rows - 1);
    for (std::size_t column = 0; column + 1 < grid.columns; ++column) {
      const double left = static_cast<double>(column) / static_cast<double>(grid.columns - 1);
      const double right = static_cast<double>(column + 1) / static_cast<double>(grid.columns - 1);
      const double far_left = height(row, column);
      const double far_right = height(row, column + 1);
      const double near_left = height(row + 1, column);
      const double near_right = height(row + 1, column + 1);
      const double mean = (far_left + far_right + near_left + near_right) / 4;
      if (!std::isfinite(mean)) {
        continue;
      }
      const double shade = Shade((far_right + near_right - far_left - near_left) / 2,
                                 (far_left + far_right - near_left - near_right) / 2);
      const Color color = Darkened(MapColor(mean), shade);
      const std::array<PointPx, 4> cell = {
          project(left, far, far_left), project(right, far, far_right),
          project(right, near, near_right), project(left, near, near_left)};
      // The edge closes the seams that smoothing leaves between neighbouring cells.
      canvas.Polygon(cell, color, Stroke{.color = color, .width_px = 0.6});
    }
  }
  DrawEnd(canvas, project, grid, height);
}

Grid Smoothed(const Grid& grid, std::size_t most_columns, std::size_t most_rows) {
  TRAMMEL_CHECK(most_columns > 0 && most_rows > 0, "{} x {}", most_rows, most_columns);
  Grid smooth{std::min(grid.columns, most_columns), std::min(grid.rows, most_rows), {}};
  const auto span = [](std::size_t i, std::size_t target, std::size_t source) {
    const std::size_t first = i * source / target;
    const std::size_t last = std::max(first + 1, (i + 1) * source / target);
    return std::pair{first > 0 ? first - 1 : 0, std::min(last + 1, source)};
  };
  std::vector<double> covered;
  for (std::size_t row = 0; row < smooth.rows; ++row) {
    const auto [top, bottom] = span(row, smooth.rows, grid.rows);
    for (std::size_t column = 0; column < smooth.columns; ++column) {
      const auto [left, right] = span(column, smooth.columns, grid.columns);
      covered.clear();
      for (std::size_t y = top; y < bottom; ++y) {
        for (std::size_t x = left; x < right; ++x) {
          if (std::isfinite(grid.at(y, x))) {
            covered.push_back(grid.at(y, x));
          }
        }
      }
      smooth.values.push_back(covered.empty() ? std::numeric_limits<double>::quiet_NaN()
                                              : Median(covered));
    }
  }
  return smooth;
}

}  // namespace trammel::report
