#include "tool_offset/original/original_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::tool_offset {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string FaultOf(std::string_view text) {
  const auto sheets = ReadOriginalScript(text);
  return sheets ? "" : sheets.error().message;
}

TEST(OriginalScript, ReadsEachPrintWithWhatWasSetBefore) {
  const auto sheets = ReadOriginalScript(
      "from calibration_pattern import calibration_pattern\n"
      "p = calibration_pattern()  # any name\n"
      "p.gen.rotation = 20\n"
      "list_of_mine = [4, 1]\r\n"
      "lines = p.full_interlocked_print(list_of_mine, 1, \"a, (b).gcode\")\n"
      "p.gen.x_offsets = [0, -0.05]\n"
      "p.full_interlocked_print([2,2,2], 2, 'c.gcode')\n"
      "p.width = 40\n"
      "lines = p.meander_print(1, 'd.gcode')\n");
  ASSERT_TRUE(sheets) << sheets.error().message;
  ASSERT_EQ(sheets->size(), 2U);
  EXPECT_THAT((*sheets)[0].tools, ElementsAre(4, 1));
  EXPECT_EQ((*sheets)[0].reference_tool, 1);
  EXPECT_EQ((*sheets)[0].rotation_deg, 20);
  EXPECT_FALSE((*sheets)[0].offsets_not_printed);
  EXPECT_THAT((*sheets)[1].tools, ElementsAre(2, 2, 2));
  EXPECT_TRUE((*sheets)[1].offsets_not_printed);
}

TEST(OriginalScript, TakesTheMachineUnderANameOfItsOwn) {
  const auto sheets = ReadOriginalScript("gen.rotation = 10\ngen.full_interlocked_print([1],0)\n");
  ASSERT_TRUE(sheets) << sheets.error().message;
  EXPECT_EQ((*sheets)[0].rotation_deg, 10);
}

TEST(OriginalScript, RefusesAnotherGeometryAtThePrintThatHasIt) {
  EXPECT_THAT(FaultOf("p.interlocked_period = 3.5\np.full_interlocked_print([1,2],1,'a')"),
              HasSubstr("line 2: interlocked_period is 3.5: only sheets with the published 4"));
}

TEST(OriginalScript, NamesTheLineOfWhatItDoesNotKnow) {
  EXPECT_THAT(FaultOf("\nfor i in range(3):\n"), HasSubstr("line 2: "));
  EXPECT_THAT(FaultOf("p.gen.colour = 3"), HasSubstr("\"colour\" is no setting"));
  EXPECT_THAT(FaultOf("p.gen.rotation = [3]"), HasSubstr("rotation is to be a number"));
  EXPECT_THAT(FaultOf("p.pitch = inf"), HasSubstr("is no number"));
  EXPECT_THAT(FaultOf("p.full_interlocked_print([1,2.5],1)"), HasSubstr("tool 2.5"));
  EXPECT_THAT(FaultOf("p.full_interlocked_print([1,1e99],1)"), HasSubstr("list of tools"));
  EXPECT_THAT(FaultOf("p.full_interlocked_print([1,2,3,4,5,6],1)"), HasSubstr("6 entries"));
  EXPECT_THAT(FaultOf("p.full_interlocked_print(nobody,1)"), HasSubstr("list of tools"));
  EXPECT_THAT(FaultOf("p.pitch = 1\n"), HasSubstr("prints no sheet"));
  EXPECT_THAT(FaultOf("p.gen.rotation = 60\np.full_interlocked_print([1],1)"),
              HasSubstr("60 degrees"));
}

// A call's value would be another one than that before it.
TEST(OriginalScript, TakesNoSettingFromACall) {
  const std::string print = "p.full_interlocked_print([1,2],1,'a')\n";
  EXPECT_THAT(FaultOf("p.gen.rotation = math.degrees(0.5)\n" + print),
              HasSubstr("line 1: rotation is to be a number"));
  EXPECT_THAT(FaultOf("p.length = float(60)\n" + print), HasSubstr("length is to be a number"));
  EXPECT_THAT(FaultOf("turn = 20\nturn = ask()\np.gen.rotation = turn\n" + print),
              HasSubstr("line 3: \"turn\" is no number"));
  EXPECT_THAT(FaultOf("setattr(p.gen, 'rotation', 20)\n" + print), HasSubstr("setattr"));
  EXPECT_THAT(FaultOf("if False: p.gen.rotation = 20\n" + print), HasSubstr("is no name"));
  EXPECT_EQ(FaultOf("p = pattern()\np.gen = machine()\n" + print), "");
}

TEST(OriginalScript, StopsAtMoreThanASettingsFileHolds) {
  EXPECT_THAT(FaultOf(std::string(2000, '\n')), HasSubstr("line 1001"));
  EXPECT_THAT(FaultOf(std::string(2000, ' ')), HasSubstr("line 1"));
  std::string prints;
  for (int i = 0; i < 30; ++i) prints += "p.full_interlocked_print([1],1)\n";
  EXPECT_THAT(FaultOf(prints), HasSubstr("more than 20 sheets"));
}

}  // namespace
}  // namespace trammel::tool_offset
