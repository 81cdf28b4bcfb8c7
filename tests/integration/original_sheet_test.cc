// The original generator's G-code, drawn by sim and read by tool_offset.
#include "sim/sheet/original_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>
#include <vector>

#include "tool_offset/original/original_sheet.h"

namespace trammel {
namespace {

using ::testing::HasSubstr;

/// The file has three decimals.
constexpr double kWritten_mm = 0.002;

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

std::string FaultOf(const std::string& gcode) {
  const auto sheet = tool_offset::ReadOriginalGcode(gcode);
  return sheet ? "" : sheet.error().message;
}

std::string Gcode(const std::vector<int>& tools) {
  sim::OriginalSheet sheet;
  sheet.tools = tools;
  return OriginalGcode(sheet);
}

TEST(OriginalGcode, GivesToolsReferenceAndTurnOfEverySizeOfSheet) {
  for (const std::vector<int>& tools :
       {std::vector{1}, {4, 2}, {1, 2, 3}, {2, 2, 1, 1}, {1, 2, 3, 4, 5}}) {
    sim::OriginalSheet printed;
    printed.tools = tools;
    printed.rotation_rad = 12.5 * std::numbers::pi / 180;
    printed.centre = {100, -30};
    const std::string gcode = OriginalGcode(printed);
    EXPECT_TRUE(tool_offset::IsOriginalGcode(gcode));
    const auto sheet = tool_offset::ReadOriginalGcode(gcode);
    ASSERT_TRUE(sheet) << sheet.error().message;
    EXPECT_EQ(sheet->tools, tools);
    EXPECT_EQ(sheet->reference_tool, 2);
    EXPECT_NEAR(sheet->rotation_deg, 12.5, 0.002);
    for (const tool_offset::SheetPoint& by : sheet->moved) EXPECT_EQ(by.u_mm, 0);
  }
}

TEST(OriginalGcode, GivesTheProgrammedOffsetOfEachPairAndIgnoresThatOfAll) {
  sim::OriginalSheet printed;
  printed.tools = {1, 2, 3};
  printed.offsets = {{0.1, -0.05}, {0, 0}, {-0.2, 0.3}};
  const auto published = tool_offset::ReadOriginalGcode(OriginalGcode(printed));
  printed.repaired = true;
  const auto repaired = tool_offset::ReadOriginalGcode(OriginalGcode(printed));
  ASSERT_TRUE(published && repaired);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(published->moved[i].u_mm, 0);
    EXPECT_NEAR(repaired->moved[i].u_mm, printed.offsets[i].x_mm, kWritten_mm);
    EXPECT_NEAR(repaired->moved[i].v_mm, printed.offsets[i].y_mm, kWritten_mm);
  }
}

TEST(OriginalGcode, RefusesFilesThatAreCutOffOrOfAnotherGeometry) {
  const std::string gcode = Gcode({1, 2, 3});
  EXPECT_THAT(FaultOf(""), HasSubstr("cut off"));
  EXPECT_THAT(FaultOf(gcode.substr(0, gcode.size() / 2)), HasSubstr("cut off"));
  sim::OriginalSheet steep;
  steep.rotation_rad = 0.8;
  EXPECT_THAT(FaultOf(OriginalGcode(steep)), HasSubstr("degrees"));
  EXPECT_THAT(FaultOf(Replaced(gcode, "\nT1\n", "\nT3\n")),
              HasSubstr("drawn by T1, its pair by T3"));
  EXPECT_THAT(FaultOf(Replaced(gcode, "\nT1\n", "\nT1000\n")), HasSubstr("tool that is no number"));
  EXPECT_THAT(FaultOf(gcode + "G1 Xnan E1\n"), HasSubstr("no letter with a number"));
  // One leg of the last comb, and a corner of the box.
  const auto moved_at = [&](std::size_t from) {
    std::string moved = gcode;
    char& digit = moved[moved.find('.', from) - 1];
    digit = digit == '5' ? '4' : '5';
    return FaultOf(moved);
  };
  EXPECT_THAT(moved_at(gcode.rfind("E0.21952") - 12), HasSubstr("of another geometry"));
  EXPECT_THAT(moved_at(gcode.find("G1 X")), HasSubstr("a line of the box is not where"));
  sim::OriginalSheet far;
  far.repaired = true;
  far.offsets.assign(far.tools.size(), {0.6, 0});
  EXPECT_THAT(FaultOf(OriginalGcode(far)), HasSubstr("on purpose"));
}

TEST(OriginalGcode, StopsAtMoreLegsThanASheetHas) {
  std::string gcode = Gcode({1});
  for (int i = 0; i < 3000; ++i) gcode += "G1 X0 Y0\nG1 X6 Y0 E1\n";
  EXPECT_THAT(FaultOf(gcode), HasSubstr("has 1321 legs"));
}

}  // namespace
}  // namespace trammel
