// A virtual board before the calibration by a board, which share no code.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "align_scene.h"
#include "base/statistics.h"
#include "board_scene.h"
#include "geometry/linear_systems.h"
#include "support/matchers.h"

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
  return Must(CalibrateByBoard(measurement, {}));
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
  has(reason(each([](auto& at) { at.x() = -at.x(); })), "mirror image");
  has(reason(each([](auto& at) { at.z() = -at.z(); })), "mirror image");
  has(reason(each([](auto& at) { at /= 25.4; })), "the unit of the places is wrong");
  has(reason(each([](auto& at) { at.z() /= 25.4; })), "the unit of Z");
  has(reason(
          [](BoardMeasurement& measurement) {
            for (auto& view : measurement.views) view.spindle_rotation.transposeInPlace();
          },
          0.5),
      "the spindle's angle is");
  has(reason([](BoardMeasurement& measurement) {
        for (std::size_t i = measurement.views.size(); i-- > 1;) {
          measurement.views[i].spindle_mm = measurement.views[i - 1].spindle_mm;
          measurement.views[i].spindle_rotation = measurement.views[i - 1].spindle_rotation;
        }
      }),
      "check the signs of the table's axes");
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

// ---- Whatever contradicts: never good and wrong.

// Few marks and pictures, for many worlds.
sim::BoardSetup QuickScene() {
  sim::BoardSetup setup = test::BoardScene(12);
  setup.sheet.columns = 7;
  setup.sheet.rows = 6;
  setup.sheet.pitch_mm = 38;
  setup.touched = {1, 7, 36, 42};
  return setup;
}

// The verdict, where the answer is not good and beyond all chance.
Verdict CheckedVerdict(const sim::BoardWorld& world, const BoardCalibration& calibration) {
  if (calibration.verdict != Verdict::kGood) {
    EXPECT_NE(calibration.reason, "");
    return calibration.verdict;
  }
  const auto error = test::BoardError(world, calibration.camera);
  const double nees = geometry::SquaredMahalanobisDistance(calibration.covariance, error);
  EXPECT_LT(nees, ChiSquareQuantile(0.99999, kCameraParameters)) << "z off by " << error[9];
  for (const auto& mark : calibration.marks) {
    constexpr double kNear_mm = 0.3;
    const auto at = static_cast<std::size_t>(std::stoi(mark.id)) - 1;
    EXPECT_LT((mark.at_mm - test::VectorOf(world.marks_mm[at])).norm(), kNear_mm) << mark.id;
  }
  return calibration.verdict;
}

TEST(BoardCalibration, TouchesThatContradictAreNeverGoodAndWrong) {
  double side = 1;
  for (const double error_mm : {0.05, 0.1, 0.3, 1.0, 5.0, 20.0}) {
    for (const unsigned wrong : {0b0001U, 0b0110U, 0b1110U}) {
      // So few pictures tell the marks' heights to some 0.03 mm against one another. Below that
      // three alike are an error of the tool itself, which nothing tells, and one other.
      constexpr double kTold_mm = 0.3;
      if (error_mm < kTold_mm && std::popcount(wrong) > 2) continue;
      side = -side;
      SCOPED_TRACE(fmt::format("{} mm, touches {:04b}", side * error_mm, wrong));
      const auto world = sim::DrawBoardWorld(QuickScene(), 40 + wrong);
      BoardMeasurement measurement = test::BoardMeasurementOf(world);
      for (std::size_t i = 0; i < 4; ++i) {
        if ((wrong >> i & 1U) != 0) measurement.touches[i].spindle_mm.z() += side * error_mm;
      }
      const BoardCalibration calibration = Calibrated(measurement);
      const Verdict verdict = CheckedVerdict(world, calibration);
      if (error_mm < kTold_mm) continue;
      EXPECT_EQ(verdict, Verdict::kRefused);
      EXPECT_NE(calibration.reason.find("touch of mark"), std::string::npos) << calibration.reason;
    }
  }
}

TEST(BoardCalibration, ALongerToolIsFoundByAnotherOneAndElseSaidToBeUnchecked) {
  const auto world = sim::DrawBoardWorld(QuickScene(), 50);
  BoardMeasurement measurement = test::BoardMeasurementOf(world);
  BoardCalibration calibration = Calibrated(measurement);
  ASSERT_EQ(CheckedVerdict(world, calibration), Verdict::kGood) << calibration.reason;
  EXPECT_NE(calibration.unchecked.find("one tool that touched (120 mm)"), std::string::npos);
  // Two of the marks by a tool that is 40 mm shorter.
  for (std::size_t i = 2; i < 4; ++i) {
    measurement.touches[i].tool_length_mm -= 40;
    measurement.touches[i].spindle_mm.z() -= 40;
  }
  calibration = Calibrated(measurement);
  ASSERT_EQ(CheckedVerdict(world, calibration), Verdict::kGood) << calibration.reason;
  EXPECT_EQ(calibration.unchecked, "");
  for (const double longer_mm : {-20.0, -5.0, -0.3, 0.3, 5.0, 20.0}) {
    BoardMeasurement wrong = measurement;
    for (std::size_t i = 0; i < 2; ++i) wrong.touches[i].spindle_mm.z() += longer_mm;
    calibration = Calibrated(wrong);
    EXPECT_EQ(calibration.verdict, Verdict::kRefused) << longer_mm;
    EXPECT_NE(calibration.reason.find("touch of mark"), std::string::npos) << calibration.reason;
  }
  // Or by the place from a drawing.
  measurement = test::BoardMeasurementOf(world);
  measurement.place =
      part_alignment::CameraPlacePrior{test::VectorOf(world.setup.lens.offset_mm), {0.5, 0.5, 0.5}};
  EXPECT_EQ(Calibrated(measurement).unchecked, "");
  for (auto& touch : measurement.touches) touch.spindle_mm.z() += 5;
  calibration = Calibrated(measurement);
  EXPECT_EQ(calibration.verdict, Verdict::kRefused);
  EXPECT_NE(calibration.reason.find("stated place of the camera"), std::string::npos)
      << calibration.reason;
}

TEST(BoardCalibration, PartsOfTheBoardThatMovedAreNeverGoodAndWrong) {
  for (const double share : {0.33, 0.5}) {
    for (const double by_mm : {0.1, 0.5, 5.0}) {
      SCOPED_TRACE(fmt::format("{} of the board by {} mm", share, by_mm));
      sim::BoardSetup setup = QuickScene();
      setup.mishap.board_moves_after = 9;
      setup.mishap.board_by_mm = {by_mm, 0.5 * by_mm, 0};
      setup.mishap.board_share = share;
      const auto world = sim::DrawBoardWorld(setup, 60);
      EXPECT_NE(CheckedVerdict(world, Calibrated(test::BoardMeasurementOf(world))), Verdict::kGood);
    }
  }
}

// The code of some marks is read as that of others in a share of the pictures.
void Misread(double share, int marks, bool swapped, std::uint64_t seed,
             BoardMeasurement& measurement) {
  Random random(seed);
  for (auto& view : measurement.views) {
    if (random.Uniform(0, 1) >= share) continue;
    for (int k = 0; k < marks; ++k) {
      const std::string from = std::to_string(9 + k);
      const std::string to = std::to_string(25 + k);
      if (!swapped) {
        std::erase_if(view.observations, [&](const auto& seen) { return seen.target == to; });
      }
      for (auto& seen : view.observations) {
        if (seen.target == from) {
          seen.target = to;
        } else if (seen.target == to) {
          seen.target = from;
        }
      }
    }
  }
}

TEST(BoardCalibration, MisreadCodesAreLeftOutOrNamedInAnyShareOfThePictures) {
  for (const double share : {0.1, 0.33, 0.6}) {
    for (const bool swapped : {false, true}) {
      for (const int marks : {1, 6}) {
        SCOPED_TRACE(
            fmt::format("{} marks {} in {}", marks, swapped ? "swapped" : "misread", share));
        const auto world = sim::DrawBoardWorld(QuickScene(), 70);
        BoardMeasurement measurement = test::BoardMeasurementOf(world);
        Misread(share, marks, swapped, 71, measurement);
        const BoardCalibration calibration = Calibrated(measurement);
        const Verdict verdict = CheckedVerdict(world, calibration);
        if (verdict == Verdict::kGood) EXPECT_GT(calibration.check.rejected, 0);
      }
    }
  }
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
