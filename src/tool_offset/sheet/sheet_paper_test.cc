// What hands meet that tape paper to the bed, and what is heated afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "base/check.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::tool_offset {
namespace {

using gcode::Dialect;
using ::testing::HasSubstr;

SheetSettings OfAbs() {
  SheetSettings settings;
  settings.filament.material = "abs";
  return settings;
}

/// What a file has told the heaters and the head when it comes to a line.
struct Machine {
  std::map<std::string, double> target_c;  ///< by heater
  std::vector<std::string> cooled;         ///< waits until something is touchable, since homing
  double y_mm = 0;
  double z_mm = 0;
};

double NumberAfter(const std::string& line, char letter) {
  const std::size_t at = line.find(std::string(" ") + letter);
  return at == std::string::npos ? 0 : std::stod(line.substr(at + 2));
}

Machine At(const std::string& text, const std::string& until) {
  Machine machine;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(until)) return machine;
    const std::string word = line.substr(0, line.find(' '));
    if (word == "G28") machine.cooled.clear();
    if (word == "M104" || word == "M109") {
      machine.target_c[line.substr(5, 2)] = NumberAfter(line, 'S') + NumberAfter(line, 'R');
    }
    if (word == "G10") machine.target_c[line.substr(4, 2)] = NumberAfter(line, 'S');
    if (word == "M140" || word == "M190") {
      machine.target_c["bed"] = NumberAfter(line, 'S') + NumberAfter(line, 'R');
    }
    const bool waits_cold = word == "TEMPERATURE_WAIT" || word == "M116" ||
                            line.find(" R40") != std::string::npos ||
                            (word == "M109" && line.find(" R50") != std::string::npos);
    if (waits_cold) machine.cooled.push_back(line);
    if (word == "G1" && line.find(" Y") != std::string::npos) machine.y_mm = NumberAfter(line, 'Y');
    if (word == "G1" && line.find(" Z") != std::string::npos) machine.z_mm = NumberAfter(line, 'Z');
  }
  ADD_FAILURE() << "no line begins with " << until;
  return machine;
}

TEST(SheetPaper, ThePaperIsTapedToAColdBedUnderAColdNozzleHighAndBehindInEveryFirmware) {
  SheetSettings settings = OfAbs();
  settings.start_gcode = "M104 S150\nM140 S110\nG28\nG29";  // a probe that wants it warm
  for (const auto& [dialect, pause] : {std::pair{Dialect::kKlipper, "PAUSE"},
                                       {Dialect::kMarlin, "M0 "},
                                       {Dialect::kRepRapFirmware, "M291 "}}) {
    settings.printer.dialect = dialect;
    const std::string text = WriteSheetGcode(PlanSheet(settings)).text;
    const Machine machine = At(text, pause);
    for (const auto& [heater, target_c] : machine.target_c) {
      if (heater == "S1") continue;  // the start G-code's own M104 without a tool
      EXPECT_EQ(target_c, 0) << heater << " " << ToString(dialect);
    }
    EXPECT_EQ(machine.target_c.count("bed"), 1u);
    // The bed and both tools are waited for behind whatever the start G-code heated.
    EXPECT_EQ(machine.cooled.size(), 3u) << ToString(dialect);
    EXPECT_EQ(machine.z_mm, 50);
    EXPECT_EQ(machine.y_mm, 245);
    const std::string after = text.substr(text.find(std::string("\n") + pause));
    EXPECT_THAT(after, HasSubstr("\nM140 S60\n"));
    EXPECT_THAT(after, HasSubstr("\nM190 S60\n"));
    EXPECT_EQ(text.find("\nM190 S110"), std::string::npos);
  }
}

TEST(SheetPaper, KlipperIsToldToStopWhereItHasNoPause) {
  const std::string text = WriteSheetGcode(PlanSheet(OfAbs())).text;
  // Of a print that somebody cancelled while it was paused nothing is left; and what PAUSE saves
  // must be there before anything is heated.
  EXPECT_THAT(text, HasSubstr("\nCLEAR_PAUSE\nPAUSE\n"));
  const Machine machine = At(text, "RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=0");
  for (const auto& [heater, target_c] : machine.target_c) EXPECT_EQ(target_c, 0) << heater;
}

TEST(SheetPaper, IsNeverWrittenWithoutATemperature) {
  EXPECT_THROW((void)WriteSheetGcode(PlanSheet({})), Bug);
}

TEST(SheetPaper, TheBedUnderPaperIsNoWarmerThan60AndAsTheSheetSays) {
  SheetSettings settings;
  settings.filament.material = "pc";
  EXPECT_THAT(WriteSheetGcode(PlanSheet(settings)).text, HasSubstr("\nM190 S60\n"));
  settings.filament.material = "tpu";
  EXPECT_THAT(WriteSheetGcode(PlanSheet(settings)).text, HasSubstr("\nM190 S50\n"));
  settings.bed_temperature_c = 0;
  const std::string cold = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_EQ(cold.find("\nM190"), std::string::npos);
  EXPECT_THAT(cold, HasSubstr("\n; heated to tpu: nozzle 230, bed 0 degC\n"));
}

TEST(SheetPaper, AFileForPaperThatLiesThereHomesNothingAndEndsColdParkedForHandsWithMotorsOn) {
  SheetSettings settings = OfAbs();
  settings.printer.dialect = Dialect::kKlipper;
  const SheetPlan plan = PlanSheet(settings);
  const std::string text = WriteSheetGcode(plan, PaperComes::kBefore).text;
  for (const char* never : {"\nG28", "\nPAUSE", "\nM84", "TEMPERATURE_WAIT"}) {
    EXPECT_EQ(text.find(never), std::string::npos) << never;
  }
  const Machine machine = At(text, "RESTORE_GCODE_STATE NAME=trammel_pattern");
  for (const auto& [heater, target_c] : machine.target_c) EXPECT_EQ(target_c, 0) << heater;
  EXPECT_EQ(machine.target_c.count("bed"), 1U);
  const PaperPark park = PaperParkOf(plan.settings);
  EXPECT_EQ(machine.z_mm, park.z_mm);
  EXPECT_EQ(machine.y_mm, park.y_mm);
  EXPECT_GE(park.z_mm, settings.paper_clearance_mm);
  // What it leaves to others: homing first, then high and behind.
  EXPECT_TRUE(HomeAndPickUpGcode(plan).starts_with("G28\n"));
  EXPECT_THAT(HomeAndPickUpGcode(plan), HasSubstr("\nT0\n"));
  EXPECT_THAT(ParkForPaperGcode(plan), HasSubstr("Y245"));
}

}  // namespace
}  // namespace trammel::tool_offset
