#include "tool_offset/original/original_gcode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tool_offset/original/original_test_support.h"

namespace trammel::tool_offset {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Two decimals beyond those of the file's places.
constexpr double kRounding_mm = 0.002;

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

std::string FaultOf(const std::string& gcode) {
  const auto sheet = ReadOriginalGcode(gcode);
  return sheet ? "" : sheet.error().message;
}

TEST(OriginalGcode, SaysToolsReferenceAndTurnOfEverySizeOfSheet) {
  for (const std::vector<int>& tools :
       {std::vector{1}, {4, 2}, {1, 2, 3}, {1, 2, 3, 4}, {1, 2, 3, 4, 5}}) {
    const auto sheet = ReadOriginalGcode(WriteOriginalGcode({tools, 2, 12.5, {}, 0, -30}));
    ASSERT_TRUE(sheet) << sheet.error().message;
    EXPECT_EQ(sheet->tools, tools);
    EXPECT_EQ(sheet->reference_tool, 2);
    EXPECT_NEAR(sheet->rotation_deg, 12.5, 0.002);
    EXPECT_TRUE(sheet->from_gcode);
    for (const SheetPoint& by : sheet->moved) EXPECT_EQ(by.u_mm, 0);
  }
}

TEST(OriginalGcode, SeesHowFarEachPairIsMovedOnPurpose) {
  OriginalPrint print;
  print.moved = {{0.1, -0.05}, {0, 0}, {-0.2, 0.3}};
  const auto sheet = ReadOriginalGcode(WriteOriginalGcode(print));
  ASSERT_TRUE(sheet) << sheet.error().message;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(sheet->moved[i].u_mm, print.moved[i][0], kRounding_mm);
    EXPECT_NEAR(sheet->moved[i].v_mm, print.moved[i][1], kRounding_mm);
  }
}

TEST(OriginalGcode, TakesAPrintThatIsMovedAsAWholeForOneWithoutOffsets) {
  OriginalPrint print;
  print.tools = {2, 2, 2, 2, 2};
  print.centre_x_mm += 0.1;
  print.centre_y_mm += 0.1;
  const auto sheet = ReadOriginalGcode(WriteOriginalGcode(print));
  ASSERT_TRUE(sheet) << sheet.error().message;
  for (const SheetPoint& by : sheet->moved) EXPECT_EQ(by.u_mm, 0);
  for (const Structure& structure : PlanOriginal(*sheet).structures) {
    EXPECT_EQ(structure.purpose, Purpose::kControl);
  }
}

TEST(OriginalGcode, NamesTheLineOfALegThatIsElsewhere) {
  const std::string gcode = WriteOriginalGcode({});
  const std::size_t comb = gcode.find(";print horizontal interlocked signal pattern 1");
  const std::size_t leg = gcode.find("E0.2195", comb);
  std::string changed = gcode;
  const std::size_t y = changed.rfind(" Y", leg) + 2;
  changed[y] = changed[y] == '9' ? '8' : '9';
  EXPECT_THAT(FaultOf(changed), HasSubstr("line "));
}

TEST(OriginalGcode, RefusesFilesThatAreCutOffOrOfAnotherGeometry) {
  const std::string gcode = WriteOriginalGcode({});
  EXPECT_THAT(FaultOf(gcode.substr(0, gcode.size() / 2)), HasSubstr("cut off"));
  EXPECT_THAT(FaultOf(gcode.substr(0, 9 * gcode.size() / 10)), HasSubstr("cut off"));
  EXPECT_THAT(FaultOf(""), HasSubstr("0 lines stand before"));
  EXPECT_THAT(FaultOf(WriteOriginalGcode({{1, 2, 3}, 2, 50, {}, 0, 0})), HasSubstr("50 degrees"));
  EXPECT_THAT(FaultOf(Replaced(gcode, "signal pattern 1", "signal pattern 0")),
              HasSubstr("stands twice"));
  EXPECT_THAT(FaultOf(Replaced(gcode, "signal pattern 1", "signal pattern 7")),
              HasSubstr("pattern 7, but there are all patterns of 3 tools only"));
  EXPECT_THAT(FaultOf(gcode + "G1 Xnan E1\n"), HasSubstr("no letter with a number"));
  EXPECT_THAT(FaultOf(Replaced(gcode, "T1\n", "T1000\n")), HasSubstr("tool that is no number"));
}

TEST(OriginalGcode, StopsAtMoreCombsOrLinesThanASheetHas) {
  std::string combs;
  for (int i = 0; i < 50; ++i) combs += ";print vertical interlocked signal pattern 0\n";
  EXPECT_THAT(FaultOf(combs), HasSubstr("more than 40 combs"));
  std::string lines;
  for (int i = 0; i < 300; ++i) lines += "G1 X1 Y" + std::to_string(i) + " E1\n";
  EXPECT_THAT(FaultOf(lines), HasSubstr("more than 200 lines"));
}

TEST(OriginalGcode, TakesFilesThatNumberEachCombForThoseThatNumberPairs) {
  std::string gcode = WriteOriginalGcode({{3, 1}, 1, 15, {{0.1, 0}, {0, 0}}, 0, 0});
  // The second comb of each section begins with its travel: no stroke of a leg before it.
  for (const int pair : {1, 0}) {
    for (const char* kind : {"vertical interlocked reference", "horizontal interlocked reference",
                             "vertical interlocked signal", "horizontal interlocked signal"}) {
      const std::string from = std::string(kind) + " pattern " + std::to_string(pair) + "\n";
      const std::size_t at = gcode.find(from);
      ASSERT_NE(at, std::string::npos);
      const std::string comment = ";print " + std::string(kind) + " pattern ";
      std::size_t second = gcode.find(" F1800\n", at);
      for (int line = 0; line < 17; ++line) second = gcode.find("G2 ", second + 1);
      second = gcode.find(
          "G1 X", gcode.find("E0.2195 F1800\n",
                             gcode.find("E0.2195 F1800\n",
                                        gcode.find("E0.2195 F1800\n",
                                                   gcode.find("E0.2195 F1800\n", second) + 1) +
                                            1) +
                                 1));
      gcode.insert(second, comment + std::to_string(2 * pair + 1) + "\n");
      gcode.replace(at, from.size(),
                    std::string(kind) + " pattern " + std::to_string(2 * pair) + "\n");
    }
  }
  const auto sheet = ReadOriginalGcode(gcode);
  ASSERT_TRUE(sheet) << sheet.error().message;
  EXPECT_THAT(sheet->tools, ElementsAre(3, 1));
  EXPECT_NEAR(sheet->moved[0].u_mm, 0.1, kRounding_mm);
}

TEST(OriginalGcode, IsKnownByItsComments) {
  EXPECT_TRUE(IsOriginalGcode(WriteOriginalGcode({})));
  EXPECT_FALSE(IsOriginalGcode("; trammel sheet: format = 3\nG1 X1 E1\n"));
}

}  // namespace
}  // namespace trammel::tool_offset
