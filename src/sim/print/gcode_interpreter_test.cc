#include "sim/print/gcode_interpreter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

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

TEST(GcodeInterpreter, SavedStateComesBackWithModesOffsetAndFeed) {
  const Program program = MustRead(
      "G90\nM82\nG92 E0\nG1 X10 E1 F600\nSAVE_GCODE_STATE NAME=a\nG91\nM83\nG1 X5 E-0.5 F6000\n"
      "RESTORE_GCODE_STATE NAME=a\nG1 X20 E2\nG1 X30\n"
      "RESTORE_GCODE_STATE NAME=a MOVE=1 MOVE_SPEED=50\n");
  ASSERT_EQ(program.moves.size(), 5U);
  EXPECT_DOUBLE_EQ(program.moves[2].to.x_mm, 20);
  EXPECT_DOUBLE_EQ(program.moves[2].e_mm, 1);  // logical 1 to 2, although 0.5 was retracted
  EXPECT_DOUBLE_EQ(program.moves[2].feed_mm_s, 10);
  EXPECT_DOUBLE_EQ(program.moves[4].to.x_mm, 10);
  EXPECT_DOUBLE_EQ(program.moves[4].feed_mm_s, 50);
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

TEST(InterpretGcode, PrusaSmoothsByWAndRepRapFirmwareDoesNot) {
  const auto smooth = [](const std::string& lines) {
    const auto program = InterpretGcode(lines + "G1 X10 E1 F600\n", {});
    EXPECT_TRUE(program) << program.error().message;
    return program ? program->moves.at(0).smooth_time_s : -1;
  };
  EXPECT_EQ(smooth("M572 D0 S0.05\n"), 0);
  EXPECT_EQ(smooth("M572 D0 S0.05 W0.02\n"), 0.02);
  EXPECT_EQ(smooth("M862.3 P \"MK4\"\nM572 S0.05\n"), 0.04);
  EXPECT_EQ(smooth("M572 S0.05 W0.02\nM572 S0.06\n"), 0.02);
  EXPECT_EQ(smooth("M900 K0.05\n"), 0);
  EXPECT_EQ(smooth("SET_PRESSURE_ADVANCE ADVANCE=0.05\n"), 0.04);
  EXPECT_FALSE(InterpretGcode("M572 S0.05 W0.3\n", {}));
}

}  // namespace
}  // namespace trammel::sim
