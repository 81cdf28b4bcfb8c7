// Figures, page, JSON and text of calibrations, part fits and budgets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "document/parsers_test_support.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/report/calibration_report.h"
#include "part_alignment/report/part_fit_report.h"
#include "support/matchers.h"

namespace trammel::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

part_alignment::CameraCalibration SomeCalibration(part_alignment::GridMeasurement& grid) {
  part_alignment::CameraCalibration calibration;
  calibration.verdict = Verdict::kGood;
  calibration.camera = part_alignment::TableOneCamera();
  const auto values = part_alignment::ParametersOf(calibration.camera);
  for (int i = 0; i < part_alignment::kCameraParameters; ++i) {
    calibration.covariance(i, i) = 1e-10 * values[i] * values[i];
  }
  calibration.nearest_mm = 395;
  calibration.farthest_mm = 1430;
  calibration.residual_rms_px = 0.02;
  calibration.residual_rms_sigma = 1;
  for (int i = 0; i < 5; ++i) {
    grid.views.push_back({{0, 0, 0}, 500.0 * i, 300.0 * i, 0.02});
    calibration.residuals.push_back({0.01, -0.02, 0.02, i != 2});
    calibration.cross_validation.push_back({400.0 + 200 * i, 9, 0.02, 1.1});
  }
  return calibration;
}

TEST(PartMetrology, FiguresOfACalibrationAreWellFormed) {
  part_alignment::GridMeasurement grid;
  const auto calibration = SomeCalibration(grid);
  const auto figures = CalibrationFigures(grid, calibration);
  ASSERT_EQ(figures.size(), 2U);
  for (const Figure& figure : figures) EXPECT_EQ(test::XmlProblem(figure.canvas.ToSvg()), "");
  EXPECT_THAT(CalibrationText(calibration), HasSubstr("focal_length_mm"));
  const auto json = nlohmann::json::parse(ToJson(calibration));
  EXPECT_EQ(json["parameters"]["z_mm"]["value"], -320.3);
  EXPECT_EQ(json["residuals"][2]["used"], false);
}

TEST(PartMetrology, WhatIsNotGoodHasNoNumbers) {
  part_alignment::CameraCalibration calibration;
  calibration.verdict = Verdict::kCannotTell;
  calibration.reason = "one plane";
  const auto json = nlohmann::json::parse(ToJson(calibration));
  EXPECT_TRUE(json["covariance"].is_null());
  EXPECT_TRUE(json["parameters"]["focal_length_mm"]["value"].is_null());
  EXPECT_THAT(CalibrationText(calibration), HasSubstr("cannot tell: one plane"));
  const auto fit = nlohmann::json::parse(ToJson(part_alignment::PartFitInput{}, {}));
  EXPECT_TRUE(fit["targets"].is_null());
  EXPECT_TRUE(fit["least_overstock_mm"].is_null());
}

TEST(PartMetrology, AStockAllowanceMapHasAPlotForEachSideThatSurfacesFace) {
  const auto height_px = [](const std::vector<part_alignment::IdealSurface>& surfaces) {
    part_alignment::PartFitInput input;
    input.surfaces = surfaces;
    part_alignment::PartFit fit;
    for (const auto& surface : surfaces) {
      const std::size_t number = fit.stock_allowances.size();
      const Eigen::Vector3d at_mm = surface.middle_mm + Eigen::Vector3d(10, 0, 0);
      input.points.push_back({surface.id, at_mm, 0.05, surface.id});
      fit.stock_allowances.push_back({number, 0.5, 3, 0.1, true});
    }
    const Figure figure = StockAllowanceFigure(input, fit);
    EXPECT_EQ(test::XmlProblem(figure.canvas.ToSvg()), "");
    return figure.canvas.height_px();
  };
  using part_alignment::SurfaceKind;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const double one_row = height_px({{"top", SurfaceKind::kPlane, z, z, 0, 3}});
  EXPECT_EQ(height_px({{"top", SurfaceKind::kPlane, z, z, 0, 3},
                       {"bottom", SurfaceKind::kPlane, -z, -z, 0, 3}}),
            one_row);
  // The point lies at +x of both axes: towards +x on the shaft, towards -x in the bore.
  EXPECT_EQ(height_px({{"shaft", SurfaceKind::kShaft, {0, 0, 0}, z, 10, 3},
                       {"bore", SurfaceKind::kBore, {0, 0, 0}, z, 10, 3},
                       {"right", SurfaceKind::kPlane, x, x, 0, 3},
                       {"left", SurfaceKind::kPlane, -x, -x, 0, 3}}),
            one_row);
  EXPECT_EQ(height_px({{"top", SurfaceKind::kPlane, z, z, 0, 3},
                       {"front", SurfaceKind::kPlane, -y, -y, 0, 3},
                       {"right", SurfaceKind::kPlane, x, x, 0, 3}}),
            2 * one_row);
}

TEST(PartMetrology, ThePageEscapesWhatComesFromOutside) {
  part_alignment::PartFit fit;
  fit.verdict = Verdict::kRefused;
  fit.reason = "<script>alert(1)</script>";
  fit.notices = {"\x01<i>"};
  const std::string page = PartFitPage({}, fit, {});
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
  EXPECT_THAT(page, Containing("&lt;script&gt;", "head refused"));
}

TEST(PartMetrology, ThePageOfAFitHasEachTargetInWords) {
  part_alignment::PartFitInput input;
  input.points = {{"p1", {0, 0, 0}, 0.05, "top"}};
  part_alignment::PartFit fit;
  fit.verdict = Verdict::kGood;
  fit.min_mm = 0.58;
  fit.stock_allowances = {{0, 0.58, 3, 0.1, true}};
  fit.targets = {{"T<1>", {1, -2, 3}}};
  fit.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  const std::string page = PartFitPage(input, fit, {});
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, Containing("0.580 mm <small>stock allowance at least", "rests on  p1 (top)",
                               "target    T&lt;1&gt;"));
}

}  // namespace
}  // namespace trammel::report
