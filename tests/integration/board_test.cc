// A virtual board before the calibration by a board, which share no code.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/chi_square.h"
#include "board_scene.h"
#include "geometry/linear_systems.h"

namespace trammel {
namespace {

using part_alignment::BoardCalibration;
using part_alignment::BoardMeasurement;
using part_alignment::CalibrateByBoard;
using part_alignment::kCameraParameters;

sim::BoardSetup SmallScene() { return test::BoardScene(24); }

BoardMeasurement Drawn(const sim::BoardSetup& setup, std::uint64_t seed) {
  return test::BoardMeasurementOf(sim::DrawBoardWorld(setup, seed));
}

BoardCalibration Calibrated(const BoardMeasurement& measurement) {
  const auto calibration = CalibrateByBoard(measurement, {});
  EXPECT_TRUE(calibration) << calibration.error().message;
  return calibration ? *calibration : BoardCalibration{};
}

TEST(BoardCalibration, GivesTheCameraBackWithoutNoise) {
  sim::BoardSetup setup = SmallScene();
  setup.sigma_px = 0;
  setup.machine = {0, 0, 0, 0, 0, 0, 0, 0};
  const auto world = sim::DrawBoardWorld(setup, 3);
  BoardMeasurement measurement = test::BoardMeasurementOf(world);
  for (auto& view : measurement.views) {
    for (auto& seen : view.observations) seen.sigma_px = 1e-4;
  }
  for (auto& touch : measurement.touches) touch.sigma_mm.z() = 1e-4;
  const BoardCalibration calibration = Calibrated(measurement);
  ASSERT_EQ(calibration.verdict, Verdict::kGood) << calibration.reason;
  const auto error = test::BoardError(world, calibration.camera);
  EXPECT_NEAR(error[0], 0, 1e-8);               // mm of focal length
  EXPECT_LT(error.segment<2>(1).norm(), 1e-4);  // px
  EXPECT_LT(error.segment<3>(7).norm(), 1e-5);  // mm
  EXPECT_LT(error.tail<3>().norm(), 1e-7);      // rad
}

TEST(BoardCalibration, StatesItsErrorsWhateverThePrint) {
  sim::BoardSetup setup = SmallScene();
  setup.sheet.print_scale = 0.01;
  setup.sheet.bend_mm = 2;
  double nees = 0;
  constexpr int kBoards = 6;
  for (std::uint64_t seed = 1; seed <= kBoards; ++seed) {
    const auto world = sim::DrawBoardWorld(setup, seed);
    const BoardCalibration calibration = Calibrated(test::BoardMeasurementOf(world));
    ASSERT_EQ(calibration.verdict, Verdict::kGood) << calibration.reason;
    ASSERT_TRUE(calibration.print);
    nees += geometry::SquaredMahalanobisDistance(calibration.covariance,
                                                 test::BoardError(world, calibration.camera));
  }
  EXPECT_LT(nees, ChiSquareQuantile(0.9999, kBoards * kCameraParameters));
  EXPECT_GT(nees, ChiSquareQuantile(0.0001, kBoards * kCameraParameters));
}

TEST(BoardCalibration, NamesEachDirectionThatNoPictureTells) {
  const sim::BoardSetup turned = SmallScene();
  BoardMeasurement untouched = Drawn(turned, 5);
  untouched.touches.clear();
  BoardCalibration calibration = Calibrated(untouched);
  EXPECT_EQ(calibration.verdict, Verdict::kCannotTell);
  EXPECT_NE(calibration.reason.find("along the spindle's axis"), std::string::npos);
  EXPECT_EQ(calibration.reason.find("across the spindle's axis"), std::string::npos);

  sim::BoardSetup straight = turned;
  for (auto& stop : straight.stops) stop.c_rad = 0;
  calibration = Calibrated(Drawn(straight, 5));
  EXPECT_EQ(calibration.verdict, Verdict::kCannotTell);
  EXPECT_NE(calibration.reason.find("across the spindle's axis"), std::string::npos);
  EXPECT_NE(calibration.reason.find("0 and at 180 degrees"), std::string::npos);

  BoardMeasurement placed = Drawn(straight, 5);
  placed.place = part_alignment::CameraPlacePrior{{-2, 0, -320}, {0.5, 0.5, 0.5}};
  calibration = Calibrated(placed);
  ASSERT_EQ(calibration.verdict, Verdict::kGood) << calibration.reason;
  EXPECT_NEAR(std::sqrt(calibration.covariance(7, 7)), 0.5, 0.05);
}

TEST(BoardCalibration, RefusesWrongSignsUnitsAndOrder) {
  const auto reason = [](const std::function<void(BoardMeasurement&)>& change, double turn = 1) {
    sim::BoardSetup setup = SmallScene();
    for (auto& stop : setup.stops) stop.c_rad *= turn;
    BoardMeasurement measurement = Drawn(setup, 7);
    change(measurement);
    const BoardCalibration calibration = Calibrated(measurement);
    EXPECT_NE(calibration.verdict, Verdict::kGood);
    return calibration.reason;
  };
  const auto each = [](const std::function<void(Eigen::Vector3d&)>& change) {
    return [change](BoardMeasurement& measurement) {
      for (auto& view : measurement.views) change(view.spindle_mm);
      for (auto& touch : measurement.touches) change(touch.spindle_mm);
    };
  };
  const auto has = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(reason(each([](auto& at) { at.x() = -at.x(); })), "the sign of X");
  has(reason(each([](auto& at) { at.z() = -at.z(); })), "the sign of Z");
  has(reason(each([](auto& at) { at /= 25.4; })), "inches");
  has(reason(each([](auto& at) { at.z() /= 25.4; })), "the unit of Z");
  has(reason(
          [](BoardMeasurement& measurement) {
            for (auto& view : measurement.views) view.spindle_rotation.transposeInPlace();
          },
          0.5),
      "angle has the wrong sign");
  has(reason([](BoardMeasurement& measurement) {
        for (std::size_t i = measurement.views.size(); i-- > 1;) {
          measurement.views[i].spindle_mm = measurement.views[i - 1].spindle_mm;
          measurement.views[i].spindle_rotation = measurement.views[i - 1].spindle_rotation;
        }
      }),
      "rows are 1 place");
}

TEST(BoardCalibration, NamesWhatMovedHalfWay) {
  const auto reason = [](const std::function<void(sim::BoardMishap&)>& change) {
    sim::BoardSetup setup = SmallScene();
    change(setup.mishap);
    const BoardCalibration calibration = Calibrated(Drawn(setup, 9));
    EXPECT_EQ(calibration.verdict, Verdict::kRefused);
    return calibration.reason;
  };
  const auto has = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(reason([](auto& mishap) {
        mishap.board_moves_after = 20;
        mishap.board_by_mm = {0.05, 0.02, 0};
      }),
      "the board moved");
  has(reason([](auto& mishap) {
        mishap.camera_moves_after = 15;
        mishap.camera_by_rad = {5e-4, 0, 0};
      }),
      "the camera was moved in its holder");
  has(reason([](auto& mishap) {
        mishap.lens_moves_after = 21;
        mishap.focal_factor = 1.001;
      }),
      "the lens was touched");
}

TEST(BoardCalibration, RefusesTwoPictureSizesAndTooFewPictures) {
  BoardMeasurement measurement = Drawn(SmallScene(), 11);
  measurement.views[3].width_px = 1296;
  measurement.views[3].height_px = 972;
  EXPECT_NE(Calibrated(measurement).reason.find("1296 x 972"), std::string::npos);
  measurement = Drawn(SmallScene(), 11);
  for (auto& view : measurement.views) view.observations.clear();
  measurement.touches.clear();
  EXPECT_EQ(Calibrated(measurement).verdict, Verdict::kCannotTell);
  measurement.views.clear();
  EXPECT_FALSE(CalibrateByBoard(measurement, {}));
}

}  // namespace
}  // namespace trammel
