// trammel offset pattern, from the shell to the files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/run_trammel.h"
#include "tool_offset/sheet/sheet_comments.h"

namespace trammel {
namespace {

using test::CommandResult;
using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(OffsetPatternCommand, WritesGcodeThatCarriesItsSettingsAndPreviews) {
  const TemporaryFolder folder;
  const CommandResult run = RunTrammel(
      "offset pattern --material pla --set 'tools=[0, 1, 2]' --set teeth=13", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, AllOf(HasSubstr("structures 16, tool changes 2"), HasSubstr("bounds ")));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.svg"), HasSubstr("<svg"));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.png"), StartsWith("\x89PNG"));
  const auto settings = tool_offset::ReadSheetFile(ReadWhole(folder.path() / "offset.gcode"));
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->tools, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(settings->teeth, 13);
}

TEST(OffsetPatternCommand, TakesThePrinterFromTheFileAndItsOwnKeysBeforeOthers) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "trammel.toml",
             "[printer]\ndialect = \"marlin\"\nbed_size_x = 300\n[filament]\n"
             "nozzle_temperature = 210\n[tool_offset_pattern]\nreference_tool = 1\n");
  const CommandResult run = RunTrammel(
      "offset pattern --material pla --tool 4 --set line_width=0.5 -o a.gcode", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.output;
  const std::string gcode = ReadWhole(folder.path() / "a.gcode");
  EXPECT_THAT(gcode, AllOf(HasSubstr("\nM109 T4 S210\n"), HasSubstr("\nM0 ")));
  const auto settings = tool_offset::ReadSheetFile(gcode);
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->tools, (std::vector<int>{1, 4}));
  EXPECT_EQ(settings->line_width_mm, 0.5);
  EXPECT_EQ(settings->printer.bed_size_x_mm, 300);
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
    const CommandResult run = RunTrammel(
        std::string("offset pattern --material pla ") + mistake.arguments, folder.path());
    EXPECT_EQ(run.exit_code, 1) << mistake.arguments;
    EXPECT_THAT(run.output, HasSubstr(mistake.says)) << mistake.arguments;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << mistake.arguments;
  }
}

TEST(OffsetPatternCommand, WritesNothingWithoutAMaterialAndSaysTheTemperaturesOfPaper) {
  const TemporaryFolder folder;
  const CommandResult refused = RunTrammel("offset pattern", folder.path());
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.output, AllOf(HasSubstr("--material"), HasSubstr("pla: nozzle 215, bed 60")));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  const CommandResult hot =
      RunTrammel("offset pattern --material abs --set bed_temperature=110", folder.path());
  EXPECT_EQ(hot.exit_code, 1);
  EXPECT_THAT(hot.output, HasSubstr("bed_temperature: 110 °C is outside 0 ... 60 °C"));
  const CommandResult run = RunTrammel("offset pattern --material abs", folder.path());
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, HasSubstr("nozzle 255, bed 60"));
  EXPECT_THAT(ReadWhole(folder.path() / "offset.gcode"),
              AllOf(HasSubstr("nozzle 255, bed 60"), HasSubstr("\nM190 S60\n")));
}

TEST(OffsetPatternCommand, WarnsOfAPitchThatLocksToTheMotors) {
  const TemporaryFolder folder;
  const CommandResult run =
      RunTrammel("offset pattern --material pla --set pitch=3.7", folder.path());
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.output, HasSubstr("warning: pitch = 3.7 mm locks"));
}

}  // namespace
}  // namespace trammel
