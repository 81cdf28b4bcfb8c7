#include "part_alignment/report/part_metrology_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"
#include "part_alignment/camera/calibrate_uncertainty.h"

namespace trammel::report {
namespace {

using part_alignment::CameraCalibration;
using part_alignment::GridMeasurement;
using part_alignment::SensorUncertainty;

/// Half of the 95 % interval of a foretold pixel, over the sensor.
std::vector<double> Within95_px(const CameraCalibration& calibration, double distance_mm,
                                int columns, int rows) {
  SensorUncertainty map = part_alignment::UncertaintyOverSensor(
      calibration.camera, calibration.covariance, distance_mm, columns, rows);
  for (double& px : map.sigma_px) px *= kNormal95;
  return map.sigma_px;
}

Canvas DrawMap(const CameraCalibration& calibration, double distance_mm, double width_px) {
  constexpr int kColumns = 54;
  constexpr int kRows = 40;
  const bool broad = width_px >= kFigureWidthPx;
  const double tall_px = broad ? 500 : 320;
  const std::vector<double> within_px = Within95_px(calibration, distance_mm, kColumns, kRows);
  const Grid grid{kColumns, kRows, within_px};
  const Range range = RangeOf(within_px);
  Canvas canvas(width_px, tall_px);
  const part_alignment::Camera& camera = calibration.camera;
  const double columns_px = camera.width_px - 1;
  const double height_px = camera.height_px - 1;
  const double bar_px = 110;
  // Rows run down: the axis is drawn from the last row at the bottom to the first on top.
  Plot plot(canvas, {6, 6, width_px - bar_px - 12, tall_px - 10},
            {"column (px)", {0, columns_px}, broad ? 6 : 3},
            {"row (px), downwards", {-height_px, 0}, 6, false},
            fmt::format("Projection uncertainty at {:.0f} mm", distance_mm));
  canvas.Image(ColorGrid(grid, range).view(), plot.inner());
  const RectPx& inner = plot.inner();
  DrawColorBar(canvas, {inner.right() + 24, inner.y, 18, inner.height}, range, "95 % (px)");
  return canvas;
}

Figure MapFigure(const CameraCalibration& calibration, double distance_mm) {
  Figure figure{
      "projection-uncertainty",
      "How far off the calibration may foretell a pixel, along the worse direction (95 %), for "
      "points at this distance from the camera. First row on top. Where it is larger than the 95 % "
      "of a target's centre, the calibration limits the measurement.",
      DrawMap(calibration, distance_mm, kFigureWidthPx)};
  figure.seen = fmt::format(
      "Map over the sensor of the uncertainty of a foretold pixel, {:.0f} mm from the camera.",
      distance_mm);
  figure.narrow = DrawMap(calibration, distance_mm, kNarrowWidthPx);
  return figure;
}

Canvas DrawResidual(const GridMeasurement& grid, const CameraCalibration& calibration,
                    double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const double tall_px = broad ? 540 : 340;
  constexpr double kKeyPx = 24;
  const double columns_px = calibration.camera.width_px - 1;
  const double height_px = calibration.camera.height_px - 1;
  Canvas canvas(width_px, tall_px);
  // Room for the arrows of places at the picture's edge.
  constexpr double kRoom = 0.03;
  const Range columns = Padded({0, columns_px}, kRoom);
  const Range rows = Padded({-height_px, 0}, kRoom);
  // Arrows of the root mean square are a 40th of the picture's width long.
  const double enlarged = columns_px / 40 / std::max(calibration.residual_rms_px, 1e-12);
  Plot plot(canvas, {6, 6 + kKeyPx, width_px - 12, tall_px - kKeyPx - 10},
            {"column (px)", columns, broad ? 6 : 3}, {"row (px), downwards", rows, 6, false},
            fmt::format("Residuals: {:.3g} px root mean square", calibration.residual_rms_px));
  const DataPoint edge[] = {
      {0, 0}, {columns_px, 0}, {columns_px, -height_px}, {0, -height_px}, {0, 0}};
  plot.Line(edge, {.color = kMuted, .width_px = 0.8});
  for (std::size_t i = 0; i < grid.views.size(); ++i) {
    const auto& view = grid.views[i];
    const auto& residual = calibration.residuals[i];
    const Color color = residual.used ? kBlue : kVermilion;
    const DataPoint line[] = {{view.column_px, -view.row_px},
                              {view.column_px + enlarged * residual.column_px,
                               -view.row_px - enlarged * residual.row_px}};
    plot.Line(line, {.color = color, .width_px = 1});
    plot.Dot(line[0], residual.used ? 1.6 : 4, color);
  }
  constexpr double kLongestKeyPx = 80;
  constexpr double kBaselinePx = 20;
  const double end =
      DrawScaleKey(canvas, {plot.inner().x, kBaselinePx}, enlarged * (plot.X(1) - plot.X(0)),
                   kLongestKeyPx, "px", {.color = kBlue, .width_px = 1.5});
  canvas.Text({end + 8, kBaselinePx}, "of residual", {.size_px = 12});
  return canvas;
}

Figure ResidualFigure(const GridMeasurement& grid, const CameraCalibration& calibration) {
  Figure figure{
      "residuals",
      "Each dot is a measured place, its line runs the way and as far as measured less projected. "
      "Orange: left out. Lines that turn together in one part of the picture speak of a lens "
      "model that does not hold there.",
      DrawResidual(grid, calibration, kFigureWidthPx)};
  figure.seen =
      fmt::format("Residuals of {} places as arrows over the picture, {:.3g} px root mean square.",
                  grid.views.size(), calibration.residual_rms_px);
  figure.narrow = DrawResidual(grid, calibration, kNarrowWidthPx);
  return figure;
}

}  // namespace

std::vector<Figure> CalibrationFigures(const GridMeasurement& grid,
                                       const CameraCalibration& calibration) {
  std::vector<Figure> figures;
  figures.push_back(MapFigure(calibration, (calibration.nearest_mm + calibration.farthest_mm) / 2));
  figures.push_back(ResidualFigure(grid, calibration));
  return figures;
}

}  // namespace trammel::report
