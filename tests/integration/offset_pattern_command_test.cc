// trammel offset pattern, from the shell to the files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/matchers.h"
#include "support/run_trammel.h"
#include "tool_offset/sheet/sheet_comments.h"

namespace trammel {
namespace {

using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(OffsetPatternCommand, WritesGcodeThatCarriesItsSettingsAndPreviews) {
  const TemporaryFolder folder;
  EXPECT_THAT(RunTrammel("offset pattern --material pla --set 'tools=[0, 1, 2]' --set teeth=13",
                         folder.path()),
              Says(0, "structures 16, tool changes 2", "bounds "));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.svg"), HasSubstr("<svg"));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.png"), StartsWith("\x89PNG"));
  const auto settings = Must(tool_offset::ReadSheetFile(ReadWhole(folder.path() / "offset.gcode")));
  EXPECT_EQ(settings.tools, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(settings.teeth, 13);
}

TEST(OffsetPatternCommand, TakesThePrinterFromTheFileAndItsOwnKeysBeforeOthers) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "trammel.toml",
             "[printer]\ndialect = \"marlin\"\nbed_size_x = 300\n[filament]\n"
             "nozzle_temperature = 210\n[tool_offset_pattern]\nreference_tool = 1\n");
  EXPECT_THAT(RunTrammel("offset pattern --material pla --tool 4 --set line_width=0.5 -o a.gcode",
                         folder.path()),
              Ends(0));
  const std::string gcode = ReadWhole(folder.path() / "a.gcode");
  EXPECT_THAT(gcode, Containing("\nM109 T4 S210\n", "\nM0 "));
  const auto settings = Must(tool_offset::ReadSheetFile(gcode));
  EXPECT_EQ(settings.tools, (std::vector<int>{1, 4}));
  EXPECT_EQ(settings.line_width_mm, 0.5);
  EXPECT_EQ(settings.printer.bed_size_x_mm, 300);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "a.svg"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "a.png"));
}

TEST(OffsetPatternCommand, EndsWithOneAndNoFileOnEveryMistake) {
  struct Mistake {
    const char* arguments;
    const char* says;
  };
  for (const Mistake& mistake :
       {Mistake{"--set 'tools=[0]'", "tools: 1 tool(s)"},
        Mistake{"--set overlap=6", "overlap: 6 mm is above 5 mm"},
        Mistake{"--set bed_size_x=115", "reaches x ="},
        Mistake{"-o a.png", "must end as G-code does"},
        Mistake{"--tool-change magnet", "must be t, activate-extruder or idex"},
        Mistake{"--tool 1 --self-test", "leave one of them out"}}) {
    const TemporaryFolder folder;
    EXPECT_THAT(RunTrammel(std::string("offset pattern --material pla ") + mistake.arguments,
                           folder.path()),
                Says(1, mistake.says))
        << mistake.arguments;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << mistake.arguments;
  }
}

TEST(OffsetPatternCommand, WritesNothingWithoutAMaterialAndSaysTheTemperaturesOfPaper) {
  const TemporaryFolder folder;
  EXPECT_THAT(RunTrammel("offset pattern", folder.path()),
              Says(1, "--material", "pla: nozzle 215, bed 60"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THAT(RunTrammel("offset pattern --material abs --set bed_temperature=110", folder.path()),
              Says(1, "bed_temperature: 110 °C is outside 0 ... 60 °C"));
  EXPECT_THAT(RunTrammel("offset pattern --material abs", folder.path()),
              Says(0, "nozzle 255, bed 60"));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.gcode"),
              Containing("nozzle 255, bed 60", "\nM190 S60\n"));
}

TEST(OffsetPatternCommand, WarnsOfAPitchThatLocksToTheMotors) {
  const TemporaryFolder folder;
  EXPECT_THAT(RunTrammel("offset pattern --material pla --set pitch=3.7", folder.path()),
              Says(0, "warning: pitch = 3.7 mm locks"));
}

}  // namespace
}  // namespace trammel
