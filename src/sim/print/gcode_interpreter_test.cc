#include "sim/print/gcode_interpreter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/random.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

Program MustRead(const std::string& text) {
  auto program = InterpretGcode(text, {});
  EXPECT_TRUE(program) << program.error().message;
  return program ? *program : Program{};
}

std::string FaultOf(const std::string& text) {
  const auto program = InterpretGcode(text, {});
  EXPECT_FALSE(program) << text;
  return program ? "" : program.error().message;
}

TEST(GcodeInterpreter, AbsoluteAndRelativeMovesEndWhereTheySay) {
  const Program program =
      MustRead("G28\nG90\nM83\ng1 x10 y20 z0.25 f600\nG1X15E0.5\nG91\nG0 Y-2.5 F1200 ; back\n");
  ASSERT_EQ(program.moves.size(), 3U);
  EXPECT_DOUBLE_EQ(program.moves[0].to.z_mm, 0.25);
  EXPECT_DOUBLE_EQ(program.moves[0].feed_mm_s, 10);
  EXPECT_DOUBLE_EQ(program.moves[1].e_mm, 0.5);
  EXPECT_DOUBLE_EQ(program.moves[1].from.x_mm, 10);
  EXPECT_DOUBLE_EQ(program.moves[2].to.y_mm, 17.5);
  EXPECT_DOUBLE_EQ(program.moves[2].feed_mm_s, 20);
  EXPECT_TRUE(program.ignored.empty());
}

TEST(GcodeInterpreter, AbsoluteFilamentCountsFromG92) {
  const Program program =
      MustRead("M82\nG92 E0\nG1 X1 E1.5 F600\nG1 X2 E2\nG92 E0\nG1 X3 E0.25\nG92 X0\nG1 X1\n");
  ASSERT_EQ(program.moves.size(), 4U);
  EXPECT_DOUBLE_EQ(program.moves[0].e_mm, 1.5);
  EXPECT_DOUBLE_EQ(program.moves[1].e_mm, 0.5);
  EXPECT_DOUBLE_EQ(program.moves[2].e_mm, 0.25);
  EXPECT_DOUBLE_EQ(program.moves[3].to.x_mm, 4);
}

TEST(GcodeInterpreter, SavedStateComesBackWithModesOffsetAndFeed) {
  const Program program = MustRead(
      "G90\nM82\nG92 E0\nG1 X10 E1 F600\nSAVE_GCODE_STATE NAME=a\nG91\nM83\nG1 X5 E-0.5 F6000\n"
      "RESTORE_GCODE_STATE NAME=a\nG1 X20 E2\nG1 X30\n"
      "RESTORE_GCODE_STATE NAME=a MOVE=1 MOVE_SPEED=50\n");
  ASSERT_EQ(program.moves.size(), 5U);
  EXPECT_DOUBLE_EQ(program.moves[2].to.x_mm, 20);
  EXPECT_DOUBLE_EQ(program.moves[2].e_mm, 1);  // from logical 1 to 2 although 0.5 was drawn back
  EXPECT_DOUBLE_EQ(program.moves[2].feed_mm_s, 10);
  EXPECT_DOUBLE_EQ(program.moves[4].to.x_mm, 10);
  EXPECT_DOUBLE_EQ(program.moves[4].feed_mm_s, 50);
}

TEST(GcodeInterpreter, RepRapFirmwaresPushAndPopAndM400AreKnown) {
  const Program program = MustRead("G90\nM120\nG91\nG1 X5 F600\nM121\nM400\nG1 X10\n");
  ASSERT_EQ(program.moves.size(), 2U);
  EXPECT_DOUBLE_EQ(program.moves[1].to.x_mm, 10);
  EXPECT_TRUE(program.moves[1].stop_before);
  EXPECT_TRUE(program.ignored.empty());
}

TEST(GcodeInterpreter, OffsetAndFactorsActOnLaterMoves) {
  const Program program = MustRead(
      "SET_GCODE_OFFSET Z=0.1\nG1 Z0.25 F600\nSET_GCODE_OFFSET Z_ADJUST=-0.05 MOVE=1\n"
      "M220 S50\nM221 S200\nM83\nG1 X1 E1\n");
  ASSERT_EQ(program.moves.size(), 3U);
  EXPECT_NEAR(program.moves[0].to.z_mm, 0.35, 1e-12);
  EXPECT_NEAR(program.moves[1].to.z_mm, 0.30, 1e-12);
  EXPECT_DOUBLE_EQ(program.moves[2].feed_mm_s, 5);
  EXPECT_DOUBLE_EQ(program.moves[2].e_mm, 2);
}

TEST(GcodeInterpreter, LimitsInForceTravelWithEachMove) {
  const Program program = MustRead(
      "SET_VELOCITY_LIMIT VELOCITY=100 ACCEL=2000 ACCEL_TO_DECEL=500 SQUARE_CORNER_VELOCITY=8\n"
      "G1 X1 F60000\nM204 S1500\nSET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0\nG1 X2\n"
      "M204 P900 T700\nG1 X3\n");
  ASSERT_EQ(program.moves.size(), 3U);
  EXPECT_DOUBLE_EQ(program.moves[0].feed_mm_s, 100);
  EXPECT_DOUBLE_EQ(program.moves[0].acceleration_mm_s2, 2000);
  EXPECT_DOUBLE_EQ(program.moves[0].minimum_cruise_ratio, 0.75);
  EXPECT_DOUBLE_EQ(program.moves[0].corner_velocity_mm_s, 8);
  EXPECT_DOUBLE_EQ(program.moves[1].acceleration_mm_s2, 1500);
  EXPECT_DOUBLE_EQ(program.moves[1].minimum_cruise_ratio, 0);
  EXPECT_DOUBLE_EQ(program.moves[2].acceleration_mm_s2, 700);
}

TEST(GcodeInterpreter, PressureAdvanceIsReadInThreeDialectsAndStopsTheMotion) {
  const Program program = MustRead(
      "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.02 SMOOTH_TIME=0.03\nG1 X1\nG1 X2\n"
      "M900 K0.04\nG1 X3\nM572 D0 S0.05\nG1 X4\nG4 P500\nG1 X5\n");
  ASSERT_EQ(program.moves.size(), 5U);
  EXPECT_DOUBLE_EQ(program.moves[0].pressure_advance_s, 0.02);
  EXPECT_DOUBLE_EQ(program.moves[0].smooth_time_s, 0.03);
  EXPECT_TRUE(program.moves[0].stop_before);
  EXPECT_FALSE(program.moves[1].stop_before);
  EXPECT_DOUBLE_EQ(program.moves[2].pressure_advance_s, 0.04);
  EXPECT_DOUBLE_EQ(program.moves[2].smooth_time_s, 0);
  EXPECT_DOUBLE_EQ(program.moves[3].pressure_advance_s, 0.05);
  EXPECT_DOUBLE_EQ(program.moves[4].dwell_before_s, 0.5);
}

TEST(GcodeInterpreter, UnknownCommandsAreCountedByName) {
  const Program program = MustRead(
      "PRINT_START BED=110\nG10\nG10\n(note)\n\xff\xfe\nM117 G1 X5 in a message\nM109 S255\n");
  EXPECT_EQ(program.ignored.at("PRINT_START"), 1);
  EXPECT_EQ(program.ignored.at("G10"), 2);
  EXPECT_TRUE(program.moves.empty());
  EXPECT_DOUBLE_EQ(program.hottest_nozzle_c, 255);
}

TEST(GcodeInterpreter, LineNumbersChecksumsAndCarriageReturnsAreDropped) {
  const Program program = MustRead("N1 G1 X1 E.5*71\r\nN2 G1 X+2 *34\r\n");
  ASSERT_EQ(program.moves.size(), 2U);
  EXPECT_DOUBLE_EQ(program.moves[1].to.x_mm, 2);
}

TEST(GcodeInterpreter, FaultsNameLineKeyValueAndBound) {
  EXPECT_THAT(FaultOf("G28\nG1 Xabc"), HasSubstr("line 2: G1 X: 'abc' is not a finite number"));
  EXPECT_THAT(FaultOf("G1 X1 Ynan"), HasSubstr("line 1: G1 Y: 'nan'"));
  EXPECT_THAT(FaultOf("G1 X1e999"), HasSubstr("'1e999'"));
  EXPECT_THAT(FaultOf("G1 X"), HasSubstr("G1 X: ''"));
  EXPECT_THAT(FaultOf("G1 X1 F0"), HasSubstr("F is 0; it must lie within"));
  EXPECT_THAT(FaultOf("G1 X1 F-100"), HasSubstr("F is -100"));
  EXPECT_THAT(FaultOf("\n\nG1 X1e5"), HasSubstr("line 3: G1 X is 100000"));
  EXPECT_THAT(FaultOf("SET_PRESSURE_ADVANCE ADVANCE=-0.1"), HasSubstr("ADVANCE is -0.1"));
  EXPECT_THAT(FaultOf("SET_PRESSURE_ADVANCE ADVANCE=0.1 SMOOTH_TIME=1"),
              HasSubstr("SMOOTH_TIME is 1"));
  EXPECT_THAT(FaultOf("M204 S0"), HasSubstr("S is 0"));
  EXPECT_THAT(FaultOf("SET_VELOCITY_LIMIT ACCEL=fast"), HasSubstr("'fast'"));
  EXPECT_THAT(FaultOf("RESTORE_GCODE_STATE NAME=x"), HasSubstr("line 1"));
  EXPECT_THAT(FaultOf("M572 D0 S11"), HasSubstr("S is 11"));
}

TEST(GcodeInterpreter, RelativeMovesCannotWalkOutOfTheWorld) {
  EXPECT_THAT(FaultOf("G91\nG1 X9000\nG1 X9000\n"), HasSubstr("line 3: X goes to 18000 mm"));
}

TEST(GcodeInterpreter, RandomTextIsReadOrRefusedButNeverMore) {
  constexpr std::uint64_t kSeed = 17;
  static constexpr char kAlphabet[] = "GMXYZEFSPKNT0123456789.-+=*;\"( \t\r\n\0e\xff";
  Random random(kSeed);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string text;
    for (int i = 0; i < 200; ++i) text += kAlphabet[random.Below(sizeof(kAlphabet) - 1)];
    const auto program = InterpretGcode(text, {});
    if (!program) {
      EXPECT_THAT(program.error().message, HasSubstr("line ")) << "seed " << kSeed;
    }
  }
}

}  // namespace
}  // namespace trammel::sim
