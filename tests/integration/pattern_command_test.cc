// trammel pa pattern and trammel config, from the shell to the files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "pressure_advance/files/plan_file.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using test::CommandResult;
using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(PatternCommand, WritesGcodeAndPlanAndSaysWhatItCosts) {
  const TemporaryFolder folder;
  EXPECT_THAT(RunTrammel("pa pattern --material abs", folder.path()),
              Says(0, "filament   16.7 mm, 0.04 g", "print ", "scan ", "together ",
                   "bounds     X 111.91 ... 138.09 mm"));
  EXPECT_THAT(ReadWhole(folder.path() / "pattern.gcode"), StartsWith("; trammel"));
  const auto plan =
      Must(files::ParsePlan(ReadWhole(folder.path() / "pattern.plan.json"), "pattern.plan.json"));
  EXPECT_EQ(plan.gcode, "pattern.gcode");
  EXPECT_EQ(plan.lines.size(), 10u);
}

TEST(PatternCommand, WritesForFirmwaresWithoutKlipperWithTheirOwnStartAndTheWayToThePrinter) {
  struct Printer {
    const char* dialect;
    const char* command;
    const char* start;
    const char* way;
  };
  for (const Printer& printer :
       {Printer{"prusa", "\nM572 S0.1\n", "\nM555 X", "to print   by USB stick"},
        Printer{"bambu", "\nM900 K0.1 L1000 M10\n", "\nG29.2 S1\nG28\n",
                "to print   in the top folder of the printer's SD card"}}) {
    const TemporaryFolder folder;
    const std::string words = std::string("pa pattern --material pla --photo --dialect ");
    const CommandResult run = RunTrammel(words + printer.dialect, folder.path());
    EXPECT_EQ(run.exit_code, 0) << run.output;
    EXPECT_THAT(run.output, AllOf(HasSubstr("take a photo"), HasSubstr(printer.way)));
    EXPECT_THAT(ReadWhole(folder.path() / "pattern.gcode"),
                AllOf(HasSubstr(printer.command), HasSubstr(printer.start)));
    const auto plan =
        files::ParsePlan(ReadWhole(folder.path() / "pattern.plan.json"), "pattern.plan.json");
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_EQ(ToString(plan->printed_by.dialect), printer.dialect);
    // The user's own start G-code wins, wherever it is set.
    WriteWhole(folder.path() / "own.toml", "[printer]\nstart_gcode = \"MY_START\"\n");
    const CommandResult own =
        RunTrammel(words + printer.dialect + " --config own.toml --out own.gcode", folder.path());
    EXPECT_EQ(own.exit_code, 0) << own.output;
    EXPECT_THAT(ReadWhole(folder.path() / "own.gcode"),
                AllOf(HasSubstr("\nMY_START\n"), Not(HasSubstr(printer.start))));
  }
}

TEST(PatternCommand, NeverOverwritesUnasked) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "a.plan.json", "mine");
  EXPECT_THAT(RunTrammel("pa pattern --material abs --out a.gcode", folder.path()),
              Says(1, "a.plan.json: is there already; --force overwrites it"));
  EXPECT_EQ(ReadWhole(folder.path() / "a.plan.json"), "mine");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.gcode"));
  EXPECT_EQ(RunTrammel("pa pattern --material abs --out a.gcode --force", folder.path()).exit_code,
            0);
  EXPECT_NE(ReadWhole(folder.path() / "a.plan.json"), "mine");
}

TEST(PatternCommand, EndsWithOneAndNoFileOnEveryMistake) {
  struct Mistake {
    const char* arguments;
    const char* says;
  };
  for (const Mistake& mistake : {
           Mistake{"--pa 0.06:0:10", "--pa 0.06:0:10: the end 0 is not above the start 0.06"},
           Mistake{"--pa 0,0.01,0.01",
                   "[pressure_advance_pattern] pressure_advances: 0.01 s "
                   "stands twice"},
           Mistake{"--pa 0,nan", "\"nan\" is not a number"},
           Mistake{"--set columns=9 --set rows=3", "columns: the print reaches x ="},
           Mistake{"--set columns=0", "columns: 0 is outside 1 ... 100"},
           Mistake{"--set dialect=grbl",
                   "must be \"klipper\", \"marlin\", \"reprapfirmware\", \"prusa\" or \"bambu\""},
           Mistake{"--pa 30:130:10", "a K of some 30 to 130 is of Marlin's LIN_ADVANCE 1.0"},
           Mistake{"--dialect bambu --pa 0,2",
                   "pressure_advances: 2 s is above 1.99999 s, the most that Bambu accepts"},
           Mistake{"--set nozzle_temperature=20", "20 °C is outside 170 ... 500 °C"},
           Mistake{"--config missing.toml", "missing.toml: there is no such file"},
           Mistake{"--config .", ".: is a folder"},
           Mistake{"--out missing/a.gcode", "missing/a.gcode: cannot be written: No such file"},
           Mistake{"--out ''", "must end in a file name"},
           Mistake{"--colour red", "--colour"},
       }) {
    const TemporaryFolder folder;
    EXPECT_THAT(
        RunTrammel(std::string("pa pattern --material abs ") + mistake.arguments, folder.path()),
        Says(1, mistake.says))
        << mistake.arguments;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << mistake.arguments;
  }
}

TEST(PatternCommand, WritesNothingThatHeatsWithoutAMaterialAndSaysBothWaysAndWhatEachWouldUse) {
  const TemporaryFolder folder;
  EXPECT_THAT(RunTrammel("pa pattern", folder.path()),
              Says(1, "--material", "nozzle_temperature and bed_temperature",
                   "pla: nozzle 215, bed 60", "abs: nozzle 255, bed 110"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THAT(RunTrammel("pa pattern --set nozzle_temperature=240", folder.path()),
              Says(1, "the bed's temperature is not given"));
  EXPECT_THAT(RunTrammel("pa pattern --material plaa", folder.path()),
              Says(1, "\"plaa\" is not known; known are pla:"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(PatternCommand, WhatPrintsIsRefusedWithoutAMaterialBeforeAnyPrinterIsAsked) {
  for (const char* command :
       {"pa calibrate", "pa calibrate --dry-run", "pa print", "pa print --dry-run",
        "pa validate 0.03", "pa validate 0.03 --dry-run"}) {
    const TemporaryFolder folder;
    EXPECT_THAT(RunTrammel(std::string(command) + " --printer unix:nowhere.sock", folder.path()),
                Says(1, "no material is named"))
        << command;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << command;
  }
  const TemporaryFolder folder;
  const auto scan = Must(RunTrammel("pa scan --dry-run", folder.path()));
  EXPECT_THAT(scan.output, Containing("; --- scan", "nozzle at 150 degC"));
  EXPECT_THAT(scan.output, testing::Not(HasSubstr("--- print")));
  EXPECT_THAT(RunTrammel("pa calibrate --dry-run --material tpu", folder.path()),
              Says(0, "; heated to tpu: nozzle 230, bed 50 degC", "\nM109 S230\n"));
}

TEST(PatternCommand, NamesTheCommandThatMeasuresIt) {
  const TemporaryFolder folder;
  const auto last = [&](const std::string& command) {
    const std::string out = RunTrammel(command, folder.path()).standard_output;
    return out.substr(out.rfind('\n', out.size() - 2) + 1);
  };
  EXPECT_THAT(last("pa pattern --material pla -o 'my a.gcode'"),
              HasSubstr("trammel pa scan --plan 'my a.plan.json'"));
  EXPECT_THAT(last("pa pattern --photo --material pla -o b.gcode"),
              HasSubstr("trammel pa analyze PHOTO --plan b.plan.json"));
  EXPECT_THAT(last("pa pattern --set dialect=marlin --material pla -o c.gcode"),
              HasSubstr("trammel pa analyze PHOTO --plan c.plan.json"));
  EXPECT_THAT(last("offset pattern --material pla -o d.gcode"),
              HasSubstr("trammel offset analyze SCAN --pattern d.gcode --result"));
}

// Given TRAMMEL_PA FILAMENT="…", whose job is a pa calibrate.
TEST(CalibrateCommand, AFilamentIsHeatedAsTheMaterialInItsName) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "trammel.toml", "[filament]\nmaterial = \"pla\"\n");
  const auto run = [&](const std::string& command) {
    return RunTrammel(command + " --dry-run", folder.path());
  };
  for (const std::string command : {"pa calibrate", "pa print --photo"}) {
    EXPECT_THAT(run(command + " --filament 'PETG Jet'").output,
                HasSubstr("; heated to petg: nozzle 235, bed 85 degC"));
    EXPECT_THAT(run(command + " --filament 'Jet Black'").output, HasSubstr("; heated to pla:"));
    EXPECT_THAT(run(command + " --filament 'PETG Jet' --material abs").output,
                HasSubstr("; heated to abs:"));
  }
  WriteWhole(folder.path() / "trammel.toml",
             "[filament]\nmaterial = \"pla\"\nnozzle_temperature = 205\n");
  EXPECT_THAT(
      run("pa calibrate --filament 'PETG Jet'"),
      Says(1, "nozzle_temperature = 205 for pla", "name --material, or --set nozzle_temperature"));
  EXPECT_THAT(run("pa calibrate --filament 'PETG Jet' --set nozzle_temperature=240").output,
              HasSubstr("nozzle 240 (set), bed 85 degC"));
  EXPECT_EQ(run("pa calibrate --filament 'PLA Jet'").exit_code, 0);
}

TEST(ConfigCommand, ChecksAFileAndNamesTheLine) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "good.toml", "[printer]\nbed_size_x = 350\n");
  WriteWhole(folder.path() / "bad.toml", "[printer]\n\nbed_size = 350\n");
  const auto good = Must(RunTrammel("config check good.toml", folder.path()));
  EXPECT_EQ(good.output, "good.toml: good, 1 key(s) set\n");
  const CommandResult bad = RunTrammel("config check bad.toml", folder.path());
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_THAT(bad.output, HasSubstr("bad.toml:3: [printer] has no key bed_size; did you mean"));
}

TEST(ConfigCommand, KeysAreAFileThatPassesItsOwnCheck) {
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "trammel.toml", RunTrammel("config keys", folder.path()).output);
  EXPECT_THAT(RunTrammel("config check", folder.path()), Ends(0));
}

}  // namespace
}  // namespace trammel
