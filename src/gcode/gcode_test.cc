#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "base/check.h"
#include "gcode/bead.h"
#include "gcode/dialect.h"

namespace trammel::gcode {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(GcodeNumber, HasNoDigitThatSaysNothing) {
  EXPECT_EQ(FormatNumber(1.5, 3), "1.5");
  EXPECT_EQ(FormatNumber(100, 3), "100");
  EXPECT_EQ(FormatNumber(100, 0), "100");
  EXPECT_EQ(FormatNumber(0.0004999, 3), "0");
  EXPECT_EQ(FormatNumber(-0.0001, 3), "0");
  EXPECT_EQ(FormatNumber(-0.25, 3), "-0.25");
  EXPECT_EQ(FormatNumber(1e6, 1), "1000000");
}

TEST(GcodeNumber, RefusesWhatNoFirmwareCanRead) {
  EXPECT_THROW((void)FormatNumber(std::nan(""), 3), Bug);
  EXPECT_THROW((void)FormatNumber(1e12, 3), Bug);
}

TEST(GcodeDialect, NamesReadBackAsThemselves) {
  for (const FirmwareWords& words : Firmwares()) {
    EXPECT_EQ(ParseDialect(ToString(words.dialect)), words.dialect);
    EXPECT_EQ(&WordsOf(words.dialect), &words);
  }
  EXPECT_EQ(ParseDialect("Klipper"), std::nullopt);
  EXPECT_EQ(DialectNames(), "klipper, marlin, reprapfirmware, prusa or bambu");
}

TEST(GcodeDialect, EveryFirmwareHasAllWordsThatEveryFileNeeds) {
  for (const FirmwareWords& words : Firmwares()) {
    for (const std::string_view word :
         {words.name, words.title, words.advance, words.keep, words.modes, words.acceleration,
          words.start_gcode, words.end_gcode}) {
      EXPECT_FALSE(word.empty()) << words.name;
    }
    EXPECT_GT(words.max_advance_s, 0) << words.name;
    EXPECT_EQ(words.relative_filament, words.modes.find("M83") != std::string_view::npos);
    EXPECT_NE(words.relative_filament, words.modes.find("M82") != std::string_view::npos);
  }
}

TEST(GcodeDialect, EachFirmwareHasItsOwnPressureAdvance) {
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kKlipper, 0.0333333),
              ElementsAre("SET_PRESSURE_ADVANCE ADVANCE=0.03333"));
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kMarlin, 0.05), ElementsAre("M900 K0.05"));
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kRepRapFirmware, 0.0), ElementsAre("M572 D0 S0"));
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kPrusa, "0.0412"), ElementsAre("M572 S0.0412"));
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kBambu, "0.0412"),
              ElementsAre("M900 K0.0412 L1000 M10"));
}

TEST(GcodeDialect, PressureAdvanceIsSetOnTheMotorsThatAreNamed) {
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kKlipper, 0.04, {{"extruder", "belted"}}),
              ElementsAre("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.04",
                          "SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.04"));
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kRepRapFirmware, 0.04, {{}, 3}),
              ElementsAre("M572 D3 S0.04"));
  // A firmware without names sets the extruder in use.
  EXPECT_THAT(PressureAdvanceCommands(Dialect::kPrusa, 0.04, {{"extruder"}, 3}),
              ElementsAre("M572 S0.04"));
}

TEST(GcodeDialect, TheToolThatStartGcodeSelectsLastPrints) {
  struct Case {
    const char* gcode;
    std::optional<int> tool;
    const char* unknown;
  };
  for (const Case& c :
       {Case{"G28\nM109 S215\n", {}, ""}, Case{"T1\nG28\n", 1, ""},
        Case{"T0\n  T2 ; PETG\n", 2, ""}, Case{"T1\r\nG28\r\n", 1, ""}, Case{"; T1\nG28", {}, ""},
        Case{"T12 P0\n", 12, ""}, Case{"TIMELAPSE_START\nT1_HEAT\n", {}, ""},
        Case{"T-1\n", {}, "T-1"}, Case{"T{global.tool}\n", {}, "T{global.tool}"},
        Case{"M98 P\"start.g\"\nG28\n", {}, "M98 P\"start.g\""},
        Case{"M98 P\"start.g\"\nT1\n", 1, ""}, Case{"T1\nM98 P\"purge.g\"\n", 1, ""},
        Case{"", {}, ""}}) {
    const SelectedTool selected = ToolSelectedBy(c.gcode);
    EXPECT_EQ(selected.number, c.tool) << c.gcode;
    EXPECT_EQ(selected.unknown, c.unknown) << c.gcode;
  }
}

TEST(GcodeDialect, TheShareThatIsCruisedIsSaidToEachKlipperAndLeftAloneWhereItIsAbsent) {
  EXPECT_EQ(LimitCommand(Dialect::kKlipper, 3000, 0.0),
            "SET_VELOCITY_LIMIT ACCEL=3000 MINIMUM_CRUISE_RATIO=0 ACCEL_TO_DECEL=3000");
  EXPECT_EQ(LimitCommand(Dialect::kKlipper, 4000, 0.25),
            "SET_VELOCITY_LIMIT ACCEL=4000 MINIMUM_CRUISE_RATIO=0.25 ACCEL_TO_DECEL=3000");
  EXPECT_EQ(LimitCommand(Dialect::kKlipper, 4000, std::nullopt), "SET_VELOCITY_LIMIT ACCEL=4000");
  EXPECT_EQ(LimitCommand(Dialect::kMarlin, 3000, 0.0), "M204 P3000 T3000");
  EXPECT_EQ(LimitCommand(Dialect::kPrusa, 3000, 0.0), "M204 P3000 T3000");
  EXPECT_EQ(LimitCommand(Dialect::kBambu, 3000, 0.0), "M204 S3000");
}

TEST(GcodeDialect, WhatAFileLeavesBehindIsSaidWithItsValues) {
  const std::vector<ChangedSetting> changed = {
      {"pressure advance", 0, 0.045, "restore_pressure_advance"},
      {"acceleration", 3000, std::nullopt, "restore_acceleration"}};
  const std::string values =
      "pressure advance is set to 0.045, acceleration stays at 3000 (set restore_acceleration)";
  EXPECT_THAT(DescribeAfterwards(Dialect::kKlipper, changed), HasSubstr("else " + values));
  EXPECT_THAT(DescribeAfterwards(Dialect::kMarlin, changed),
              HasSubstr(values + "; speed and flow"));
}

TEST(GcodeDialect, AMessageNeverBecomesACommand) {
  EXPECT_THAT(DisplayCommands(Dialect::kKlipper, "PA 0.01\nM112"),
              ElementsAre("M117 PA 0.01 M112"));
  EXPECT_THAT(DisplayCommands(Dialect::kPrusa, ""), ElementsAre("M117"));
  EXPECT_THAT(DisplayCommands(Dialect::kBambu, "PA 0.01"), IsEmpty());
}

TEST(ToolCommands, PauseEndsThePrintOfAKlipperThatKnowsNoPause) {
  // An unknown PAUSE is not an error there; the state that it would have saved is missed.
  EXPECT_THAT(PauseCommands(Dialect::kKlipper, "Tape it"),
              ElementsAre("M117 Tape it", "CLEAR_PAUSE", "PAUSE", HasSubstr("; without"),
                          "RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=0"));
  EXPECT_THAT(PauseCommands(Dialect::kMarlin, "Tape it"), ElementsAre("M0 Tape it"));
  EXPECT_THAT(PauseCommands(Dialect::kRepRapFirmware, "Tape \"it\""),
              ElementsAre("M291 P\"Tape  it \" R\"trammel\" S3"));
}

TEST(ToolCommands, CoolingIsWaitedForAndLeavesTheHeaterOff) {
  EXPECT_THAT(CoolBedCommands(Dialect::kKlipper, 40),
              ElementsAre("M140 S0", "TEMPERATURE_WAIT SENSOR=heater_bed MAXIMUM=40"));
  EXPECT_THAT(CoolToolCommands(Dialect::kKlipper, 1, 50),
              ElementsAre("M104 T1 S0", "TEMPERATURE_WAIT SENSOR=extruder1 MAXIMUM=50"));
  for (const Dialect dialect : {Dialect::kMarlin, Dialect::kRepRapFirmware}) {
    EXPECT_THAT(CoolBedCommands(dialect, 40), ElementsAre("M140 S0", "M190 R40", "M140 S0"));
  }
  EXPECT_THAT(CoolToolCommands(Dialect::kMarlin, 1, 50),
              ElementsAre("M104 T1 S0", "M109 T1 R50", "M104 T1 S0"));
  EXPECT_THAT(CoolToolCommands(Dialect::kRepRapFirmware, 1, 50),
              ElementsAre("G10 P1 S50 R50", "M116 P1", "G10 P1 S0 R0"));
}

TEST(Placeholders, AreReplacedOnceAndBracesCanBeWritten) {
  const std::vector<Placeholder> known{{"a", "{b}"}, {"b", "2"}};
  EXPECT_EQ(*ExpandPlaceholders("x {a} {b} {{b}}", known), "x {b} 2 {b}");
  EXPECT_EQ(*ExpandPlaceholders("", known), "");
}

TEST(Placeholders, AnUnknownOneIsNamedWithTheKnownAndItsLine) {
  const std::vector<Placeholder> known{{"bed_temperature_c", "60"}, {"min_x_mm", "5"}};
  const auto result = ExpandPlaceholders("G28\nM140 S{bed_temp}\n", known);
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("line 2: unknown placeholder {bed_temp}"));
  EXPECT_THAT(result.error().message, HasSubstr("{bed_temperature_c} {min_x_mm}"));
}

TEST(Placeholders, ABraceWithoutItsPartnerIsAnErrorAndNotSwallowed) {
  for (const char* text : {"{", "}", "a{b", "{b\n}", "{b{b}", "x}y"}) {
    const auto result = ExpandPlaceholders(text, std::vector<Placeholder>{{"b", "2"}});
    ASSERT_FALSE(result) << text;
    EXPECT_THAT(result.error().message, HasSubstr("without its partner")) << text;
  }
}

TEST(MoveTime, IsATrapezoidsOrATriangles) {
  EXPECT_NEAR(MoveTime_s(100, 50, 1000), 100 / 50.0 + 50 / 1000.0, 1e-12);
  EXPECT_NEAR(MoveTime_s(1, 50, 1000), 2 * std::sqrt(1 / 1000.0), 1e-12);
  EXPECT_NEAR(MoveTime_s(10, 50, 50, 50, 1000), 0.2, 1e-12);
  EXPECT_EQ(MoveTime_s(0, 50, 1000), 0);
}

}  // namespace
}  // namespace trammel::gcode
