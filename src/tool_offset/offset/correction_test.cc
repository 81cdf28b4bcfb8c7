#include "tool_offset/offset/correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::tool_offset {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using enum OffsetFirmware;

// Computes the position of a line for the command (0, 0), by each firmware's own arithmetic.
// `nozzle` is the true position of the tool's nozzle relative to the reference tool's.
double Lands(OffsetFirmware firmware, double nozzle_mm, double kept_mm) {
  switch (firmware) {
    case kKlipperTool:
    case kKlipperGcodeOffset:
      return nozzle_mm + kept_mm;  // gcode_position + offset is where the head goes
    case kMarlin:
    case kRepRapFirmware:
      return nozzle_mm - kept_mm;  // the head goes back by what the nozzle stands out
  }
  return 0;
}

TEST(Correction, TakesTheMeasuredOffsetOutInEveryFirmware) {
  for (const OffsetFirmware firmware :
       {kKlipperTool, kKlipperGcodeOffset, kMarlin, kRepRapFirmware}) {
    SCOPED_TRACE(ToString(firmware));
    const double nozzle_mm = 0.321;
    const KeptOffset now = {-0.2, 0.7};
    const double dx_mm = Lands(firmware, nozzle_mm, now.x_mm);
    const double dy_mm = Lands(firmware, nozzle_mm, now.y_mm);
    const KeptOffset next = Corrected(firmware, now, dx_mm, dy_mm);
    constexpr double kRounding_mm = 1e-12;
    EXPECT_NEAR(Lands(firmware, nozzle_mm, next.x_mm), 0, kRounding_mm);
    EXPECT_NEAR(Lands(firmware, nozzle_mm, next.y_mm), 0, kRounding_mm);
  }
}

TEST(Correction, WritesEachFirmwaresOwnCommands) {
  const KeptOffset offset = {0.1234, -0.0004};
  EXPECT_THAT(SetCommands(kKlipperTool, 1, offset),
              ElementsAre("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.123",
                          "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset VALUE=0.000"));
  EXPECT_THAT(SetCommands(kKlipperGcodeOffset, 1, offset),
              ElementsAre("SET_GCODE_OFFSET X=0.123 Y=0.000"));
  EXPECT_THAT(SetCommands(kMarlin, 3, offset), ElementsAre("M218 T3 X0.123 Y0.000"));
  EXPECT_THAT(SetCommands(kRepRapFirmware, 2, offset), ElementsAre("G10 P2 X0.123 Y0.000"));
}

TEST(Correction, SaysHowItIsKept) {
  EXPECT_THAT(SaveCommands(kKlipperTool, 1),
              ElementsAre("SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset",
                          "SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset"));
  EXPECT_THAT(SaveAdvice(kKlipperTool, 1, {}), HasSubstr("SAVE_CONFIG"));
  EXPECT_THAT(SaveCommands(kMarlin, 1), ElementsAre("M500"));
  EXPECT_THAT(SaveCommands(kRepRapFirmware, 1), ElementsAre("M500 P10"));
  EXPECT_THAT(SaveCommands(kKlipperGcodeOffset, 1), IsEmpty());
  EXPECT_THAT(SaveAdvice(kKlipperGcodeOffset, 1, {0.5, 0}),
              HasSubstr("[gcode_macro T1] of printer.cfg:  SET_GCODE_OFFSET X=0.500 Y=0.000"));
  EXPECT_THAT(SaveAdvice(kMarlin, 1, {}), IsEmpty());
}

}  // namespace
}  // namespace trammel::tool_offset
