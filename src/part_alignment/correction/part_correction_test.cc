#include "part_alignment/correction/part_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/random.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using ::testing::HasSubstr;

constexpr double kRounding_mm = 1e-9;  // metres in double precision, a few operations

// Three below (along Z), two behind (along Y), one at the left (along X).
std::vector<Support> SixPoints() {
  return {{"z1", {0, 0, 0}, Vector3d::UnitZ()},      {"z2", {1500, 0, 0}, Vector3d::UnitZ()},
          {"z3", {750, 1000, 0}, Vector3d::UnitZ()}, {"y1", {200, 0, 100}, Vector3d::UnitY()},
          {"y2", {1300, 0, 100}, Vector3d::UnitY()}, {"x1", {0, 500, 100}, Vector3d::UnitX()}};
}

TEST(CorrectFixture, SixSupportsBringTheWholePoseToTheIdeal) {
  // Half a degree and a few millimetres: the linear theory would be off by 1e-2 mm.
  const Pose measured{{103.2, -41.7, 250.6}, {0.009, -0.007, 0.012}};
  const Pose ideal{{100, -40, 250}, {0, 0, 0.01}};
  const auto fixed =
      Must(CorrectFixture(measured, SixPoints(), ideal.angles_rad, ideal.translation_mm));
  EXPECT_EQ(fixed.rank, 6);
  for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(1500, 1000, 500)}) {
    // The supports' points slide across their directions, so that only the pose is determined by
    // the shims; it comes out right to the second order of that slide.
    const Vector3d miss_mm =
        MachineFromPart(fixed.machine_from_part, point) - MachineFromPart(ideal, point);
    EXPECT_LT(miss_mm.norm(), 1e-6) << miss_mm.transpose();
  }
}

TEST(CorrectFixture, ALowCornerIsShimmedUpByAsMuchAsItIsLow) {
  // +beta turns z towards x: points at +x go down by 1 mm/m.
  const Pose measured{{0, 0, 300}, {0, 1e-3, 0}};
  const std::vector<Support> supports = {{"left", {0, 0, 0}, Vector3d::UnitZ()},
                                         {"right", {1000, 0, 0}, Vector3d::UnitZ()},
                                         {"back", {500, 800, 0}, Vector3d::UnitZ()}};
  const auto fixed =
      Must(CorrectFixture(measured, supports, Vector3d::Zero(), Vector3d(0, 0, 300)));
  EXPECT_NEAR(fixed.moves[0].shim_mm, 0, kRounding_mm);
  EXPECT_NEAR(fixed.moves[1].shim_mm, 1, 1e-6);  // sin(1e-3) m
  EXPECT_NEAR(fixed.moves[2].shim_mm, 0.5, 1e-6);
  EXPECT_EQ(fixed.rank, 3);
  EXPECT_NEAR(fixed.rotation_rad.y(), -1e-3, 1e-12);
  EXPECT_NEAR(fixed.machine_from_part.angles_rad.y(), 0, 1e-9);
}

TEST(CorrectFixture, WithoutAnIdealOriginTheSupportsMoveLeastOnTheAverage) {
  const Pose measured{{12, 34, 300}, {2e-3, -1e-3, 0.3}};
  const auto fixed = Must(CorrectFixture(measured, SixPoints(), Vector3d(0, 0, 0.3), std::nullopt));
  Vector3d sum = Vector3d::Zero();
  for (const SupportMove& move : fixed.moves) sum += move.displacement_mm;
  EXPECT_LT(sum.norm(), kRounding_mm);
  EXPECT_LT(fixed.machine_from_part.angles_rad.head<2>().norm(), 1e-9);
}

TEST(CorrectFixture, WhatTheSupportsLeaveFreeDoesNotMove) {
  const Pose measured{{5, 6, 7}, {1e-3, 2e-3, 0.1}};
  const std::vector<Support> below = {{"1", {0, 0, 0}, Vector3d::UnitZ()},
                                      {"2", {1000, 0, 0}, Vector3d::UnitZ()},
                                      {"3", {0, 1000, 0}, Vector3d::UnitZ()}};
  const auto fixed = Must(CorrectFixture(measured, below, Vector3d(0, 0, 0.4), std::nullopt));
  EXPECT_EQ(fixed.rank, 3);
  // The turn about Z of 0.3 rad that the ideal asks for is not the supports' to give.
  EXPECT_NEAR(fixed.machine_from_part.angles_rad.z(), 0.1, 1e-5);
  EXPECT_LT(fixed.machine_from_part.angles_rad.head<2>().norm(), 1e-3);
}

TEST(CorrectFixture, RefusesSupportsThatAreGivenTwiceOrAreNone) {
  const Pose measured{{0, 0, 0}, {1e-3, 0, 0}};
  std::vector<Support> four = {{"1", {0, 0, 0}, Vector3d::UnitZ()},
                               {"2", {1000, 0, 0}, Vector3d::UnitZ()},
                               {"3", {0, 1000, 0}, Vector3d::UnitZ()},
                               {"4", {0, 1000, 500}, Vector3d::UnitZ()}};
  // More than hold the part, but all asked for one rigid motion.
  EXPECT_TRUE(CorrectFixture(measured, four, Vector3d::Zero(), std::nullopt));
  four[3].id = "1";
  EXPECT_THAT(CorrectFixture(measured, four, Vector3d::Zero(), {}).error().message,
              HasSubstr("support 1 is given twice"));
  four[3] = {"4", {0, 0, 0}, Vector3d(0, 0, 2)};
  EXPECT_THAT(CorrectFixture(measured, four, Vector3d::Zero(), {}).error().message,
              HasSubstr("support 4: its direction has the length 2"));
  four[3] = {"4", {0, std::nan(""), 0}, Vector3d::UnitZ()};
  EXPECT_FALSE(CorrectFixture(measured, four, Vector3d::Zero(), {}));
  EXPECT_FALSE(CorrectFixture(measured, {}, Vector3d::Zero(), {}));
  const Pose broken{{0, 0, std::numeric_limits<double>::infinity()}, {0, 0, 0}};
  EXPECT_FALSE(CorrectFixture(broken, SixPoints(), Vector3d::Zero(), {}));
}

TEST(CorrectWorkOffset, StatesWhatATiltLeavesOver) {
  const Pose measured{{1, 2, 3}, {0, 1e-3, 0.5}};
  const OffsetCorrection correction =
      CorrectWorkOffset(measured, {{"near", {0, 0, 0}}, {"far", {1000, 0, 0}}});
  EXPECT_LT(correction.remainder[0].error_mm.norm(), kRounding_mm);
  // The far end lies 1 mm lower than the offset says.
  EXPECT_NEAR(correction.remainder[1].error_mm.z(), 1, 1e-6);
  EXPECT_NEAR(correction.largest_remainder_mm, 1, 1e-3);
  EXPECT_EQ(correction.tilt_rad, Eigen::Vector2d(0, 1e-3));
}

TEST(CorrectWorkOffset, IsNotGivenForAPartThatLiesOnItsFace) {
  const std::vector<PartTarget> points = {{"a", {-750, -500, 0}}, {"b", {750, 500, 0}}};
  // Mirrored targets result in half a turn about X.
  EXPECT_THAT(CheckTilt(CorrectWorkOffset({{1, 2, 3}, {3.1399, 0.001, 3.14}}, points)),
              FailsWith("leans by 179.9 degrees", "mirrored"));
  EXPECT_FALSE(CheckTilt(CorrectWorkOffset({{1, 2, 3}, {0, -0.11, 0}}, points)));
  EXPECT_TRUE(CheckTilt(CorrectWorkOffset({{1, 2, 3}, {0.06, -0.06, -2}}, points)));
}

TEST(CorrectFixture, AfterTheFixtureTheWorkOffsetLeavesNothingOver) {
  Random random(2041);
  for (int i = 0; i < 200; ++i) {
    const auto draw = [&random](double half) { return random.Uniform(-half, half); };
    const Pose measured{{draw(5000), draw(5000), draw(2000)}, {draw(0.02), draw(0.02), draw(3)}};
    std::vector<Support> supports = SixPoints();
    // The stops stand across the part as it lies.
    const Eigen::Matrix3d turn = geometry::RotationFromAngles({0, 0, measured.angles_rad.z()});
    for (Support& support : supports) support.direction_machine = turn * support.direction_machine;
    const auto fixed = CorrectFixture(measured, supports, {0, 0, measured.angles_rad.z()}, {});
    ASSERT_TRUE(fixed) << "seed 2041, run " << i << ": " << fixed.error().message;
    const OffsetCorrection left =
        CorrectWorkOffset(fixed->machine_from_part, {{"corner", {1500, 1000, 500}}});
    EXPECT_LT(left.largest_remainder_mm, 1e-6) << "seed 2041, run " << i;
  }
}

}  // namespace
}  // namespace trammel::part_alignment
