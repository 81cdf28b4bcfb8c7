#include "sim/sheet/sheet_gcode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kExactMm = 1e-9;  // sums of a few doubles below 1000

SheetProgram Interpreted(const std::string& gcode, const SheetSetup& setup = {}) {
  const auto program = InterpretSheet(gcode, setup);
  EXPECT_TRUE(program) << (program ? "" : program.error().message);
  return program ? *program : SheetProgram{};
}

std::string ErrorOf(const std::string& gcode, const SheetSetup& setup = {}) {
  const auto program = InterpretSheet(gcode, setup);
  return program ? "no error" : program.error().message;
}

// Returns the machine's position after the last move.
PlaneMm End(const SheetProgram& program) {
  return program.moves.empty() ? PlaneMm{} : program.moves.back().to;
}

void ExpectAt(const PlaneMm& place, double x_mm, double y_mm) {
  EXPECT_NEAR(place.x_mm, x_mm, kExactMm);
  EXPECT_NEAR(place.y_mm, y_mm, kExactMm);
}

SheetSetup Of(SheetFirmware firmware) {
  SheetSetup setup;
  setup.firmware = firmware;
  return setup;
}

constexpr auto kKlipper = SheetFirmware::kKlipper;
constexpr auto kMarlin = SheetFirmware::kMarlin;
constexpr auto kRrf = SheetFirmware::kRepRapFirmware;

TEST(SheetGcode, KlipperAddsTheGcodeOffsetAndMarlinAndRrfSubtractTheToolOffset) {
  ExpectAt(End(Interpreted("SET_GCODE_OFFSET X=0.3 Y=-0.2\nG1 X10 Y10", Of(kKlipper))), 10.3, 9.8);
  ExpectAt(End(Interpreted("M218 T1 X0.3 Y-0.2\nT1\nG1 X10 Y10", Of(kMarlin))), 9.7, 10.2);
  ExpectAt(End(Interpreted("G10 P1 X0.3 Y-0.2\nT1\nG1 X10 Y10", Of(kRrf))), 9.7, 10.2);
}

TEST(SheetGcode, AToolchangerSetsTheGcodeOffsetWhenTheToolChanges) {
  SheetSetup setup;
  setup.stored[1] = PlaneMm{0.25, -0.5};
  ExpectAt(End(Interpreted("G1 X10 Y10\nT1\nG1 X20 Y20", setup)), 20.25, 19.5);
  ExpectAt(End(Interpreted("T1\nT0\nG1 X20 Y20", setup)), 20, 20);
  // Selecting the tool in use changes nothing, nor does a parameter until the next change.
  const std::string stored = "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.75\n";
  ExpectAt(End(Interpreted("T1\n" + stored + "T1\nG1 X20 Y20", setup)), 20.25, 19.5);
  ExpectAt(End(Interpreted(stored + "SELECT_TOOL T=1\nG1 X20 Y20", setup)), 20.75, 19.5);
}

TEST(SheetGcode, MarlinTakesNewOffsetsAtTheNextToolChangeAndMovesTheNozzleThere) {
  const SheetProgram program = Interpreted("G1 X10 Y10\nM218 T1 X1\nT1", Of(kMarlin));
  ExpectAt(End(program), 9, 10);
  ExpectAt(End(Interpreted("T1\nM218 T1 X1\nG1 X10 Y10", Of(kMarlin))), 10, 10);
}

TEST(SheetGcode, RrfTakesNewOffsetsAtOnceAndG10AloneIsARetraction) {
  ExpectAt(End(Interpreted("T1\nG10 P1 X1\nG1 X10 Y10", Of(kRrf))), 9, 10);
  ExpectAt(End(Interpreted("T1\nG10 L1 P1 X1\nG10\nG1 X10 Y10", Of(kRrf))), 9, 10);
  EXPECT_THAT(ErrorOf("T-1\nM83\nG1 X10 E1", Of(kRrf)), HasSubstr("without a tool"));
}

TEST(SheetGcode, MacrosAndTemplatesSelectTools) {
  SheetSetup setup;
  const auto macros = ParseSheetMacros(
      "[printer]\nkinematics: corexy\n[gcode_macro T1]\ngcode:\n  ACTIVATE_EXTRUDER "
      "EXTRUDER=extruder1 # the other\n  SET_GCODE_OFFSET X=0.4\n");
  ASSERT_TRUE(macros) << macros.error().message;
  setup.macros = *macros;
  setup.tool_commands = {"PICK N={tool}"};
  const SheetProgram program = Interpreted("T1\nG1 X10\npick n=3 ; the third\nG1 X20", setup);
  ASSERT_EQ(program.moves.size(), 2U);
  EXPECT_EQ(program.moves[0].tool, 1);
  EXPECT_NEAR(program.moves[0].to.x_mm, 10.4, kExactMm);
  EXPECT_EQ(program.moves[1].tool, 3);
  EXPECT_EQ(program.moves[1].pick_up, 2);
}

TEST(SheetGcode, TwoCarriagesHaveAnXOfTheirOwn) {
  const SheetProgram program = Interpreted(
      "M83\nG1 X10 Y5\nSET_DUAL_CARRIAGE CARRIAGE=1\nACTIVATE_EXTRUDER EXTRUDER=extruder1\n"
      "G1 X200 E1\nSET_DUAL_CARRIAGE CARRIAGE=0\nACTIVATE_EXTRUDER EXTRUDER=extruder\nG1 Y6 E1");
  EXPECT_EQ(program.moves[1].tool, 1);
  EXPECT_EQ(program.moves[1].x_drive, 1);
  ExpectAt(End(program), 10, 6);
  EXPECT_THAT(ErrorOf("M83\nSET_DUAL_CARRIAGE CARRIAGE=1\nG1 X5 E1"),
              HasSubstr("extruder 0 extrudes while carriage 1 moves"));
}

TEST(SheetGcode, RefusesByNameWhatItCannotDo) {
  EXPECT_THAT(ErrorOf("G2 X1 Y1 I1"), HasSubstr("line 1: G2"));
  EXPECT_THAT(ErrorOf("\nG20"), HasSubstr("line 2: G20"));
  EXPECT_THAT(ErrorOf("T9"), HasSubstr("no tool 9"));
  EXPECT_THAT(ErrorOf("G1 Xnan"), HasSubstr("not a finite number"));
  EXPECT_THAT(ErrorOf("G1 X1e9"), HasSubstr("must lie within"));
  EXPECT_THAT(ErrorOf("SET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY"), HasSubstr("MODE=COPY"));
  EXPECT_THAT(ErrorOf("ACTIVATE_EXTRUDER EXTRUDER=stepper"), HasSubstr("STEPPER"));
  EXPECT_THAT(ErrorOf("G10 L2 P1 X0", Of(kRrf)), HasSubstr("G10 L is 2"));
  SheetSetup setup;
  setup.macros["AGAIN"] = "AGAIN\n";
  EXPECT_THAT(ErrorOf("AGAIN", setup), HasSubstr("nested deeper"));
  const auto macros = ParseSheetMacros("[gcode_macro A]\ngcode:\n  G1 X{params.X}\n");
  ASSERT_FALSE(macros);
  EXPECT_THAT(macros.error().message, HasSubstr("line 3: macro A uses a template"));
}

}  // namespace
}  // namespace trammel::sim
