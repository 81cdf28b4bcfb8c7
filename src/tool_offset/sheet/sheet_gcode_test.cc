#include "tool_offset/sheet/sheet_gcode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "base/check.h"
#include "support/matchers.h"
#include "tool_offset/sheet/sheet_bed.h"

namespace trammel::tool_offset {
namespace {

using gcode::Dialect;
using ::testing::HasSubstr;
using ::testing::Not;

/// Positions are written to 0.1 µm.
constexpr double kWritten_mm = 1e-4;

SheetSettings OfAbs() {
  SheetSettings settings;
  settings.filament.material = "abs";
  return settings;
}

struct Move {
  double x_mm = 0, y_mm = 0, z_mm = 0;  ///< end point
  double from_x_mm = 0, from_y_mm = 0;
  double filament_mm = 0;
  int tool = 0;

  [[nodiscard]] double Length_mm() const { return std::hypot(x_mm - from_x_mm, y_mm - from_y_mm); }
};

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

bool ChangesTool(const std::string& line) {
  return line.size() > 1 && line[0] == 'T' && line.find_first_not_of("0123456789", 1) == line.npos;
}

/// A printer that knows G1 and T, told anew here.
std::vector<Move> Printed(const std::string& text) {
  std::vector<Move> moves;
  Move at;
  for (const std::string& line : Lines(text)) {
    if (ChangesTool(line)) at.tool = std::stoi(line.substr(1));
    if (!line.starts_with("G1 ")) continue;
    Move move = at;
    move.from_x_mm = at.x_mm;
    move.from_y_mm = at.y_mm;
    move.filament_mm = 0;
    std::istringstream words(line.substr(3));
    for (std::string word; words >> word;) {
      const double value = std::stod(word.substr(1));
      if (word[0] == 'X') move.x_mm = value;
      if (word[0] == 'Y') move.y_mm = value;
      if (word[0] == 'Z') move.z_mm = value;
      if (word[0] == 'E') move.filament_mm = value;
    }
    moves.push_back(move);
    at = move;
  }
  return moves;
}

bool Draws(const Move& move) { return move.filament_mm > 0 && move.Length_mm() > 0; }

TEST(SheetGcode, EveryLegOfThePlanIsDrawnOnceByItsToolWhereItShouldBe) {
  SheetSettings settings = OfAbs();
  settings.tools = {2, 0, 5};
  settings.reference_tool = 0;
  settings.pick_ups = 1;
  const SheetPlan plan = PlanSheet(settings);
  std::vector<Move> missing;
  const auto expect = [&](int tool, const Leg& leg) {
    const BedPoint from = OnBed(plan, leg.start);
    const BedPoint to = OnBed(plan, leg.end);
    Move move;
    move.tool = tool;
    move.from_x_mm = from.x_mm;
    move.from_y_mm = from.y_mm;
    move.x_mm = to.x_mm;
    move.y_mm = to.y_mm;
    missing.push_back(move);
  };
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      for (int finger = 0; finger < settings.teeth; ++finger) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) {
          expect(structure.combs[comb].tool, leg);
        }
      }
    }
  }
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) expect(0, CodeLeg(plan, cell));
  }
  for (const PrimeLine& line : plan.prime_lines) expect(line.tool, line.leg);
  std::size_t box_sides = 0;
  for (const Move& move : Printed(WriteSheetGcode(plan).text)) {
    if (!Draws(move)) continue;
    const auto found = std::find_if(missing.begin(), missing.end(), [&](const Move& leg) {
      return leg.tool == move.tool && std::abs(leg.x_mm - move.x_mm) < kWritten_mm &&
             std::abs(leg.y_mm - move.y_mm) < kWritten_mm &&
             std::abs(leg.from_x_mm - move.from_x_mm) < kWritten_mm &&
             std::abs(leg.from_y_mm - move.from_y_mm) < kWritten_mm;
    });
    if (found != missing.end()) {
      missing.erase(found);
    } else {
      ++box_sides;
      EXPECT_EQ(move.tool, 0);
    }
  }
  EXPECT_EQ(box_sides, 12u);
  EXPECT_TRUE(missing.empty()) << missing.size() << " legs were not drawn";
}

TEST(SheetGcode, BothAxesRunTheLegsWayFor2MillimetresBeforeItBegins) {
  const SheetSettings settings = OfAbs();
  const SheetPlan plan = PlanSheet(settings);
  const std::vector<Move> moves = Printed(WriteSheetGcode(plan).text);
  int legs = 0;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const Move& leg = moves[i];
    if (!Draws(leg) || leg.Length_mm() > settings.leg_length_mm + kWritten_mm) continue;
    // The last move in x or y before it.
    std::size_t before = i - 1;
    while (moves[before].Length_mm() == 0) --before;
    const Move& run_in = moves[before];
    EXPECT_EQ(run_in.filament_mm, 0);
    EXPECT_GT(run_in.z_mm, leg.z_mm) << "the nozzle is down";
    EXPECT_NEAR(run_in.Length_mm(), settings.run_in_mm, 2 * kWritten_mm);
    const double along = ((run_in.x_mm - run_in.from_x_mm) * (leg.x_mm - leg.from_x_mm) +
                          (run_in.y_mm - run_in.from_y_mm) * (leg.y_mm - leg.from_y_mm)) /
                         run_in.Length_mm() / leg.Length_mm();
    EXPECT_NEAR(along, 1, 1e-6);
    // More than the play that is promised, in both axes.
    EXPECT_GT(std::abs(run_in.x_mm - run_in.from_x_mm), 0.2);
    EXPECT_GT(std::abs(run_in.y_mm - run_in.from_y_mm), 0.2);
    ++legs;
  }
  // 2 x 6 structures, 2 x 17 fingers and 2 legs each, and the dark cells.
  EXPECT_GT(legs, 12 * 68);
}

TEST(SheetGcode, NothingIsDraggedOverThePaperAndNoFilamentIsLost) {
  SheetSettings settings = OfAbs();
  settings.tools = {0, 1, 2};
  settings.flows = {1, 1.1, 0.9};
  settings.retract_lengths_mm = {0.5, 4, 0};
  const SheetPlan plan = PlanSheet(settings);
  const SheetGcode gcode = WriteSheetGcode(plan);
  const double down_mm = settings.layer_height_mm + settings.paper_thickness_mm;
  std::map<int, double> held_back_mm;
  for (const Move& move : Printed(gcode.text)) {
    double& held_mm = held_back_mm[move.tool];
    if (move.Length_mm() > 0 && move.z_mm < down_mm + settings.printer.z_hop_mm - kWritten_mm) {
      EXPECT_TRUE(Draws(move));
      EXPECT_NEAR(move.z_mm, down_mm, kWritten_mm);
      EXPECT_NEAR(held_mm, 0, 1e-9);
    } else if (move.filament_mm < 0) {
      held_mm -= move.filament_mm;
      EXPECT_NEAR(held_mm, settings.retract_lengths_mm[static_cast<std::size_t>(move.tool)], 1e-9);
    } else if (move.filament_mm > 0) {
      held_mm = 0;  // the first push of a tool also primes
    }
    if (Draws(move)) {
      const double per_mm = 0.4 * 0.2 - 0.2 * 0.2 * (1 - std::numbers::pi / 4);
      const double filament_mm2 = std::numbers::pi / 4 * 1.75 * 1.75;
      EXPECT_NEAR(move.filament_mm,
                  move.Length_mm() * per_mm / filament_mm2 *
                      settings.flows[static_cast<std::size_t>(move.tool)],
                  2e-5);
    }
  }
}

std::vector<std::string> LinesWith(const std::string& text, const std::string& start) {
  std::vector<std::string> found;
  for (const std::string& line : Lines(text)) {
    if (line.starts_with(start)) found.push_back(line);
  }
  return found;
}

std::vector<std::string> ToolChanges(const std::string& text) {
  std::vector<std::string> found = Lines(text);
  std::erase_if(found, [](const std::string& line) { return !ChangesTool(line); });
  return found;
}

TEST(SheetGcode, ToolsAreTakenOnceReferenceFirstAndTheReferenceAtTheEnd) {
  SheetSettings settings = OfAbs();
  settings.tools = {3, 1, 0};
  settings.reference_tool = 1;
  const SheetGcode gcode = WriteSheetGcode(PlanSheet(settings));
  EXPECT_THAT(ToolChanges(gcode.text), testing::ElementsAre("T1", "T3", "T0", "T1"));
  EXPECT_EQ(gcode.tool_changes, 2);
  settings.pick_ups = 1;
  EXPECT_THAT(ToolChanges(WriteSheetGcode(PlanSheet(settings)).text),
              testing::ElementsAre("T1", "T3", "T0", "T1", "T3", "T0", "T1"));
}

TEST(SheetGcode, EveryToolIsColdAtTheEndAndHotOnlyInItsTurn) {
  SheetSettings settings = OfAbs();
  settings.tools = {0, 1};
  settings.nozzle_temperatures_c = {210, 240};
  settings.filament.idle_nozzle_temperature_c = 150;
  for (const Dialect dialect : {Dialect::kKlipper, Dialect::kMarlin}) {
    settings.printer.dialect = dialect;
    std::map<std::string, std::string> target;
    std::vector<std::string> heated;
    for (const std::string& line : Lines(WriteSheetGcode(PlanSheet(settings)).text)) {
      if (line.starts_with("M104 T") || line.starts_with("M109 T")) {
        target[line.substr(5, 2)] = line.substr(8);
        if (line.starts_with("M109") && line.find(" S") != std::string::npos) {
          heated.push_back(line);
        }
        if (line == "M109 T1 S240") {
          EXPECT_EQ(target["T0"], "S0");
        }
        if (line == "M109 T0 S210") {
          EXPECT_EQ(target["T1"], "S150");
        }
      }
    }
    EXPECT_THAT(heated, testing::ElementsAre("M109 T0 S210", "M109 T1 S240"));
    EXPECT_EQ(target["T0"], "S0");
    EXPECT_EQ(target["T1"], "S0");
  }
  settings.printer.dialect = Dialect::kRepRapFirmware;
  const std::string text = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_THAT(text, Containing("G10 P1 S240 R240\nM116 P1\nT1\n", "G10 P0 S0 R0\nG10 P1 S0 R0\n"));
}

TEST(SheetGcode, EachFirmwareHasItsOwnPauseAndState) {
  SheetSettings settings = OfAbs();
  settings.printer.dialect = Dialect::kKlipper;
  const std::string klipper = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_THAT(klipper, HasSubstr("\nPAUSE\n"));
  // The state belongs to the reference tool: kept after it was taken, brought back with it.
  EXPECT_THAT(klipper, HasSubstr("T0\nG90 ; absolute positions\nM83 ; relative E\nG1 Z20.3 F300\n"
                                 "SAVE_GCODE_STATE NAME=trammel_pattern\n"));
  EXPECT_LT(klipper.rfind("\nT0\n"), klipper.find("RESTORE_GCODE_STATE NAME=trammel_pattern"));
  settings.printer.dialect = Dialect::kMarlin;
  const std::string marlin = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_THAT(marlin, Containing("\nM0 Tape the paper", Not(HasSubstr("GCODE_STATE"))));
  settings.printer.dialect = Dialect::kRepRapFirmware;
  const std::string rrf = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_THAT(rrf, Containing("\nM291 P\"Tape the paper", "\nM120\n", "\nM121\n"));
  settings.pause = false;
  EXPECT_THAT(WriteSheetGcode(PlanSheet(settings)).text, Not(HasSubstr("M291")));
  settings.pause = true;
  settings.pause_gcode = "MY_PAUSE TOOL={tool}";
  EXPECT_THAT(WriteSheetGcode(PlanSheet(settings)).text, HasSubstr("\nMY_PAUSE TOOL=0\n"));
}

TEST(SheetGcode, ToolChangesPrimingAndWipingAreTheUsersOwn) {
  SheetSettings settings = OfAbs();
  settings.tool_change_gcode =
      "SET_DUAL_CARRIAGE CARRIAGE={tool}\nACTIVATE_EXTRUDER EXTRUDER={extruder}";
  settings.prime_gcode = "PRIME T={tool} FROM={previous_tool} AT={tool_temperature_c}";
  settings.wipe_gcode = "WIPE T={tool}";
  const std::string text = WriteSheetGcode(PlanSheet(settings)).text;
  EXPECT_THAT(text, Containing("\nSET_DUAL_CARRIAGE CARRIAGE=1\nACTIVATE_EXTRUDER "
                               "EXTRUDER=extruder1\nG90 ; absolute positions\nM83",
                               "\nPRIME T=1 FROM=0 AT=255\nG90 ; absolute positions\nM83"));
  EXPECT_EQ(LinesWith(text, "WIPE T=0").size(), 1u);
  EXPECT_EQ(LinesWith(text, "WIPE T=1").size(), 1u);
  EXPECT_EQ(LinesWith(text, "PRIME T=").size(), 2u);
}

TEST(SheetGcode, PrintsWithinTheBedAndCountsItsFilament) {
  SheetSettings settings = OfAbs();
  settings.tools = {0, 1, 2, 3, 4};
  const SheetGcode gcode = WriteSheetGcode(PlanSheet(settings));
  double filament_mm = 0;
  for (const Move& move : Printed(gcode.text)) {
    filament_mm += move.filament_mm;
    if (!Draws(move)) continue;
    for (const double at_mm : {move.x_mm, move.y_mm, move.from_x_mm, move.from_y_mm}) {
      EXPECT_GT(at_mm, settings.printer.bed_margin_mm);
      EXPECT_LT(at_mm, 250 - settings.printer.bed_margin_mm);
    }
  }
  EXPECT_NEAR(gcode.filament_mm, filament_mm, 1e-4 * gcode.filament_mm);
  EXPECT_GT(gcode.time_s, 600);
  EXPECT_LT(gcode.time_s, 7200);
}

/// State of heaters and head when a file reaches a line.
struct Machine {
  std::map<std::string, double> target_c;  ///< per heater
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
    EXPECT_THAT(after, Containing("\nM140 S60\n", "\nM190 S60\n"));
    EXPECT_EQ(text.find("\nM190 S110"), std::string::npos);
  }
}

TEST(SheetPaper, KlipperIsToldToStopWhereItHasNoPause) {
  const std::string text = WriteSheetGcode(PlanSheet(OfAbs())).text;
  // No state of a print cancelled while paused may persist; and PAUSE must save its state before
  // anything is heated.
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
  // Steps outside the file: homing first, then high and behind.
  EXPECT_TRUE(HomeAndPickUpGcode(plan).starts_with("G28\n"));
  EXPECT_THAT(HomeAndPickUpGcode(plan), HasSubstr("\nT0\n"));
  EXPECT_THAT(ParkForPaperGcode(plan), HasSubstr("Y245"));
}

}  // namespace

}  // namespace trammel::tool_offset
