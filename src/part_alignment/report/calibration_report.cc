#include "part_alignment/report/calibration_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"
#include "document/plot.h"
#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/report/answer_page.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::BoardCalibration;
using part_alignment::BoardViewResult;
using part_alignment::CameraCalibration;
using part_alignment::GridMeasurement;
using part_alignment::kCameraParameters;
using part_alignment::NullDirection;
using part_alignment::SensorUncertainty;

const char* ParameterName(int i) {
  return part_alignment::kCameraParameterNames[static_cast<std::size_t>(i)];
}

template <class Calibration>
Json ParametersJson(const Calibration& calibration) {
  const bool good = calibration.verdict == Verdict::kGood;
  const auto values = part_alignment::ParametersOf(calibration.camera);
  Json parameters = Json::object();
  for (int i = 0; i < kCameraParameters; ++i) {
    parameters[ParameterName(i)] = {
        {"value", good ? Number(values[i]) : Json(nullptr)},
        {"standard_uncertainty",
         good ? Number(std::sqrt(calibration.covariance(i, i))) : Json(nullptr)}};
  }
  return parameters;
}

// Lists each parameter with its 95 % interval, to eight digits: distortion has many zeros behind
// its point.
std::string ParameterLines(const part_alignment::Camera& camera,
                           const part_alignment::CameraCovariance& covariance) {
  std::string text;
  const auto values = part_alignment::ParametersOf(camera);
  for (int i = 0; i < kCameraParameters; ++i) {
    const auto [lo, hi] = NormalInterval95(values[i], std::sqrt(covariance(i, i)));
    text += fmt::format("  {:<20} {:>16} (95 %: {:.8g} to {:.8g})\n", ParameterName(i),
                        fmt::format("{:.8g}", values[i]), lo, hi);
  }
  return text;
}

Json NullJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const NullDirection& direction : calibration.null_directions) {
    list.push_back(
        {{"what", direction.what},
         {"taken_from", direction.taken_from},
         {"closed_by", direction.closed_by},
         {"standard_uncertainty", direction.sigma ? Number(*direction.sigma) : Json(nullptr)},
         {"unit", direction.unit}});
  }
  return list;
}

Json ViewsJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const BoardViewResult& view : calibration.views) {
    Json entry = {
        {"picture", view.picture}, {"used", view.used}, {"observations", view.observations}};
    if (view.used) {
      entry["rms_px"] = Number(view.rms_px);
      entry["off_mm"] = List(view.off_mm);
    } else {
      entry["reason"] = view.reason;
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json MarksJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const auto& mark : calibration.marks) {
    list.push_back({{"id", mark.id},
                    {"machine_mm", List(mark.at_mm)},
                    {"observations", mark.observations},
                    {"rms_px", Number(mark.rms_px)}});
  }
  return list;
}

// Formats the uncertainty in its customary unit.
std::string SigmaText(const NullDirection& direction) {
  if (!direction.sigma) return {};
  if (direction.unit == "mm") {
    return fmt::format("within {:.3g} um", kUmPerMm * kNormal95 * *direction.sigma);
  }
  if (direction.unit == "rad") {
    return fmt::format("within {:.3g} mm/m", 1e3 * kNormal95 * *direction.sigma);
  }
  return fmt::format("within {:.3g} ppm", 1e6 * kNormal95 * *direction.sigma);
}

std::string TakenText(const NullDirection& direction) {
  return direction.taken_from.empty() ? "nothing: there is no answer" : direction.taken_from;
}

std::string PrintText(const BoardCalibration& calibration) {
  const auto& print = *calibration.print;
  return fmt::format(
      "{:.3f} % to the right and {:.3f} % upwards of what it was meant to be, bent "
      "by {:.2f} mm ({} marks)",
      100 * print.scale_right, 100 * print.scale_up, print.bend_mm, print.marks);
}

// Describes the next step with a calibrated camera, or without one.
std::string CameraText(bool good, double nearest_mm, double farthest_mm, std::string_view again) {
  if (!good) {
    return fmt::format("Put right what the reason above names and {}. No camera file was written.",
                       again);
  }
  return fmt::format(
      "Name the file of --out as camera of the observations, and look at targets from {:.0f} to "
      "{:.0f} mm: outside that range the lens is extrapolated.",
      nearest_mm, farthest_mm);
}

// Makes the page of a calibration of either kind.
// @param again  remedy if it is not good, as an order: "measure another grid"
template <class Calibration>
AnswerPage PageOfCalibration(std::string title, const Calibration& calibration,
                             std::string_view again) {
  const bool good = calibration.verdict == Verdict::kGood;
  AnswerPage page;
  page.title = std::move(title);
  page.verdict = calibration.verdict;
  page.value = good ? fmt::format("{:.4f} px", calibration.residual_rms_px) : "No calibration";
  if (good) page.detail = "residual, root mean square";
  page.reason = calibration.reason;
  page.next = CameraText(good, calibration.nearest_mm, calibration.farthest_mm, again);
  page.notices = calibration.notices;
  return page;
}

/// Computes half of the 95 % interval of a predicted pixel, over the sensor.
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

std::string ToJson(const CameraCalibration& calibration) {
  const bool good = calibration.verdict == Verdict::kGood;
  Json planes = Json::array();
  for (const auto& plane : calibration.cross_validation) {
    planes.push_back({{"distance_mm", plane.distance_mm},
                      {"views", plane.views},
                      {"rms_px", Number(plane.rms_px)},
                      {"rms_sigma", Number(plane.rms_sigma)}});
  }
  Json residuals = Json::array();
  for (const auto& residual : calibration.residuals) {
    residuals.push_back({{"column_px", Number(residual.column_px)},
                         {"row_px", Number(residual.row_px)},
                         {"sigma_px", Number(residual.sigma_px)},
                         {"used", residual.used}});
  }
  return JsonText({{"format", 1},
                   {"verdict", ToString(calibration.verdict)},
                   {"reason", calibration.reason},
                   {"check", CheckJson(calibration.check)},
                   {"parameters", ParametersJson(calibration)},
                   {"covariance", good ? Rows(calibration.covariance) : Json(nullptr)},
                   {"residual_rms_px", Number(calibration.residual_rms_px)},
                   {"residual_rms_sigma", Number(calibration.residual_rms_sigma)},
                   {"degrees_of_freedom", calibration.degrees_of_freedom},
                   {"distance_mm", good ? Json::array({Number(calibration.nearest_mm),
                                                       Number(calibration.farthest_mm)})
                                        : Json(nullptr)},
                   {"cross_validation", planes},
                   {"residuals", residuals},
                   {"notices", calibration.notices}});
}

std::string ToJson(const BoardCalibration& calibration) {
  const bool good = calibration.verdict == Verdict::kGood;
  Json print = nullptr;
  if (calibration.print) {
    print = {{"scale_right", Number(calibration.print->scale_right)},
             {"scale_up", Number(calibration.print->scale_up)},
             {"bend_mm", Number(calibration.print->bend_mm)},
             {"marks", calibration.print->marks}};
  }
  const auto pair = [&](const Eigen::Vector2d& v) { return good ? List(v) : Json(nullptr); };
  return JsonText({{"format", 1},
                   {"verdict", ToString(calibration.verdict)},
                   {"reason", calibration.reason},
                   {"parameters", ParametersJson(calibration)},
                   {"covariance", good ? Rows(calibration.covariance) : Json(nullptr)},
                   {"residual_rms_px", Number(calibration.residual_rms_px)},
                   {"residual_rms_sigma", Number(calibration.residual_rms_sigma)},
                   {"repeatability_mm", Number(calibration.repeatability_mm)},
                   {"degrees_of_freedom", calibration.degrees_of_freedom},
                   {"check", CheckJson(calibration.check)},
                   {"unchecked", calibration.unchecked},
                   {"distance_mm", pair({calibration.nearest_mm, calibration.farthest_mm})},
                   {"lean_rad", pair(calibration.lean_rad)},
                   {"lean_standard_uncertainty_rad", pair(calibration.lean_sigma_rad)},
                   {"not_seen", NullJson(calibration)},
                   {"sheet", print},
                   {"marks", MarksJson(calibration)},
                   {"views", ViewsJson(calibration)},
                   {"notices", calibration.notices}});
}

std::string CalibrationText(const CameraCalibration& calibration) {
  std::string text = VerdictLine(calibration.verdict, calibration.reason);
  text += fmt::format("check     {}\n", CheckText(calibration.check));
  if (calibration.verdict == Verdict::kGood) {
    text += ParameterLines(calibration.camera, calibration.covariance);
    text += fmt::format(
        "residuals {:.4f} px root mean square, {:.2f} of what was stated\n"
        "range     {:.0f} … {:.0f} mm from the camera\n",
        calibration.residual_rms_px, calibration.residual_rms_sigma, calibration.nearest_mm,
        calibration.farthest_mm);
    for (const auto& plane : calibration.cross_validation) {
      text +=
          fmt::format("held out  {:>6.0f} mm: {} views foretold to {:.4f} px, {:.2f} of expected\n",
                      plane.distance_mm, plane.views, plane.rms_px, plane.rms_sigma);
    }
  }
  return text + Lines("notice", calibration.notices);
}

std::string CalibrationText(const BoardCalibration& calibration) {
  std::string text = VerdictLine(calibration.verdict, calibration.reason);
  if (calibration.check.observations > 0) {
    text += fmt::format("check     {}\n", CheckText(calibration.check));
  }
  if (!calibration.unchecked.empty()) {
    text += fmt::format("unchecked {}\n", calibration.unchecked);
  }
  if (calibration.verdict == Verdict::kGood) {
    text += ParameterLines(calibration.camera, calibration.covariance);
    text += fmt::format(
        "residuals {:.4f} px root mean square, {:.2f} of what was stated; places {:.1f} um\n"
        "range     {:.0f} … {:.0f} mm from the camera\n",
        calibration.residual_rms_px, calibration.residual_rms_sigma,
        kUmPerMm * calibration.repeatability_mm, calibration.nearest_mm, calibration.farthest_mm);
  }
  if (calibration.print) text += fmt::format("sheet     {}\n", PrintText(calibration));
  for (const NullDirection& direction : calibration.null_directions) {
    const std::string sigma = SigmaText(direction);
    text +=
        fmt::format("not seen  {}: taken from {}{}{}; closed by {}\n", direction.what,
                    TakenText(direction), sigma.empty() ? "" : ", ", sigma, direction.closed_by);
  }
  return text + Lines("notice", calibration.notices);
}

std::vector<Figure> CalibrationFigures(const GridMeasurement& grid,
                                       const CameraCalibration& calibration) {
  std::vector<Figure> figures;
  figures.push_back(MapFigure(calibration, (calibration.nearest_mm + calibration.farthest_mm) / 2));
  figures.push_back(ResidualFigure(grid, calibration));
  return figures;
}

std::string CalibrationPage(const std::string& date,
                            const part_alignment::CameraCalibration& calibration,
                            std::span<const Figure> figures) {
  AnswerPage page =
      PageOfCalibration("Camera calibration of " + date, calibration, "measure another grid");
  page.text = CalibrationText(calibration);
  return AnswerPageHtml(page, figures);
}

std::string CalibrationPage(const std::string& date, const BoardCalibration& calibration) {
  AnswerPage page = PageOfCalibration("Camera calibration on the machine, " + date, calibration,
                                      "take the pictures anew");
  if (!calibration.unchecked.empty()) page.unchecked = {calibration.unchecked};
  page.text = CalibrationText(calibration);
  return AnswerPageHtml(page, {});
}

}  // namespace trammel::report
