// Check of the file as a printer would read it, by a reader independent of the layout.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "base/check.h"
#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern.h"

namespace trammel::pressure_advance {
namespace {

/// One G0 or G1 as it would be carried out, after the modes before it.
struct ReadMove {
  bool travel = false;  ///< G0
  double from[3] = {0, 0, 0};
  double to[3] = {0, 0, 0};
  double filament_mm = 0;
  double retracted_mm = 0;  ///< below the furthest that E has been, before the move
  double speed_mm_s = 0;
  std::string pressure_advance;  ///< the command in force
};

std::map<char, double> Words(const std::string& line) {
  std::map<char, double> words;
  std::istringstream in(line.substr(0, line.find(';')));
  for (std::string word; in >> word;) words[word[0]] = std::stod(word.substr(1));
  return words;
}

std::vector<ReadMove> ReadMoves(const std::string& gcode) {
  std::vector<ReadMove> moves;
  std::istringstream in(gcode);
  ReadMove state;
  double e_mm = 0;
  double furthest_mm = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("SET_PRESSURE_ADVANCE") || line.starts_with("M900") ||
        line.starts_with("M572")) {
      state.pressure_advance = line;
    }
    if (!line.starts_with("G0 ") && !line.starts_with("G1 ")) continue;
    ReadMove move = state;
    move.travel = line.starts_with("G0");
    for (const auto& [letter, value] : Words(line)) {
      if (letter >= 'X' && letter <= 'Z') move.to[letter - 'X'] = value;
      if (letter == 'F') move.speed_mm_s = value / 60;
      if (letter == 'E') {
        move.retracted_mm = furthest_mm - e_mm;
        move.filament_mm = value - e_mm;
        e_mm = value;
        furthest_mm = std::max(furthest_mm, e_mm);
      }
    }
    if (move.filament_mm == 0) move.retracted_mm = furthest_mm - e_mm;
    moves.push_back(move);
    state = move;
    std::copy(move.to, move.to + 3, state.from);
    state.filament_mm = 0;
  }
  return moves;
}

double Length(const ReadMove& move) {
  return std::hypot(move.to[0] - move.from[0], move.to[1] - move.from[1]);
}

PatternConfig OfAbs() {
  PatternConfig config;
  config.material = "abs";
  return config;
}

std::string GcodeOf(const PatternConfig& config) { return WriteGcode(LayOut(config), config); }

TEST(PatternGcode, PrintsEachLineUnderItsOwnPressureAdvanceInEveryDialect) {
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    const gcode::Dialect dialect = words.dialect;
    PatternConfig config = OfAbs();
    config.dialect = dialect;
    config.frame_pressure_advance_s = 0.02;
    const PatternLayout layout = LayOut(config);
    std::size_t segments = 0;
    for (const ReadMove& move : ReadMoves(WriteGcode(layout, config))) {
      if (move.travel || Length(move) == 0) continue;
      const bool frame = std::abs(move.speed_mm_s - config.frame_speed_mm_s) < 0.01;
      const double expected_s =
          frame ? 0.02 : layout.lines[segments / config.segments.size()].pressure_advance_s;
      EXPECT_EQ(move.pressure_advance, PressureAdvanceCommands(dialect, expected_s).front());
      if (frame) continue;
      EXPECT_EQ(move.speed_mm_s, config.segments[segments % 3].speed_mm_s);
      ++segments;
    }
    EXPECT_EQ(segments, 30u);
  }
}

bool HasLine(const std::string& gcode, const std::string& line) {
  return ("\n" + gcode).find("\n" + line + "\n") != std::string::npos;
}

TEST(PatternGcode, EndsWithHeatersOffUnlessItIsToIdle) {
  PatternConfig config = OfAbs();
  EXPECT_TRUE(GcodeOf(config).ends_with("M104 S0\nM140 S0\nM84\n"));
  config.finish = Finish::kIdle;
  EXPECT_TRUE(GcodeOf(config).ends_with("; idle G-code\nM104 S195\n"));
  EXPECT_FALSE(HasLine(GcodeOf(config), "M140 S0"));
}

TEST(PatternGcode, RestoresWhatItChanged) {
  PatternConfig config = OfAbs();
  config.restore_pressure_advance_s = 0.045;
  config.restore_acceleration_mm_s2 = 5000;
  const std::string klipper = GcodeOf(config);
  EXPECT_TRUE(HasLine(klipper, "SAVE_GCODE_STATE NAME=trammel_pattern"));
  EXPECT_TRUE(HasLine(klipper, "RESTORE_GCODE_STATE NAME=trammel_pattern"));
  EXPECT_TRUE(HasLine(klipper, "SET_PRESSURE_ADVANCE ADVANCE=0.045"));
  EXPECT_TRUE(HasLine(
      klipper, "SET_VELOCITY_LIMIT ACCEL=5000 MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500"));
  // The macros come last: what was in force when the print began wins over what the settings know.
  EXPECT_GT(klipper.find("\n_TRAMMEL_BRING_BACK_SETTINGS\n"), klipper.find("ACCEL=5000"));
  EXPECT_LT(klipper.find("\n_TRAMMEL_KEEP_SETTINGS ;"), klipper.find("ACCEL=3000"));
  // A Klipper before 2024 knows the share as an acceleration alone: of that which stays in force.
  config.restore_acceleration_mm_s2 = std::nullopt;
  EXPECT_TRUE(HasLine(GcodeOf(config),
                      "SET_VELOCITY_LIMIT ACCEL=3000 MINIMUM_CRUISE_RATIO=0.5 "
                      "ACCEL_TO_DECEL=1500"));
  config.dialect = gcode::Dialect::kMarlin;
  EXPECT_EQ(GcodeOf(config).find("_TRAMMEL"), std::string::npos);
  EXPECT_FALSE(HasLine(GcodeOf(config), "M204 P5000 T5000"));
  config.restore_acceleration_mm_s2 = 5000;
  EXPECT_TRUE(HasLine(GcodeOf(config), "M204 P5000 T5000"));
  EXPECT_TRUE(HasLine(GcodeOf(config), "M900 K0.045"));
}

TEST(PatternGcode, PutsValuesIntoTheUsersOwnGcode) {
  PatternConfig config = OfAbs();
  config.start_gcode =
      "PRINT_START EXTRUDER={nozzle_temperature_c} BED={bed_temperature_c} "
      "AREA={min_x_mm},{min_y_mm},{max_x_mm},{max_y_mm}";
  EXPECT_TRUE(HasLine(GcodeOf(config),
                      "PRINT_START EXTRUDER=255 BED=110 AREA=108.9662,102.3112,141.0338,147.6888"));
}

TEST(PatternGcode, HeatsBehindAStartGcodeThatReceivesNoTemperature) {
  PatternConfig config = OfAbs();
  config.start_gcode = "PRINT_START\n";
  const std::string neither = GcodeOf(config);
  EXPECT_TRUE(HasLine(neither, "M190 S110"));
  EXPECT_TRUE(HasLine(neither, "M109 S255"));
  EXPECT_LT(neither.find("PRINT_START"), neither.find("M109 S255"));
  EXPECT_LT(neither.find("M109 S255"), neither.find("G1 "));
  config.start_gcode = "PRINT_START EXTRUDER={nozzle_temperature_c}\n";
  const std::string nozzle = GcodeOf(config);
  EXPECT_TRUE(HasLine(nozzle, "M190 S110"));
  EXPECT_FALSE(HasLine(nozzle, "M109 S255"));
  config.start_gcode += "M190 S{bed_temperature_c}\n";
  EXPECT_FALSE(GcodeOf(config).find("does not name") != std::string::npos);
  config.bed_temperature_c = 0;
  config.start_gcode = "PRINT_START\n";
  EXPECT_TRUE(HasLine(GcodeOf(config), "M140 S0"));
}

TEST(PatternGcode, RepRapFirmwaresDriveIsThatOfTheToolThatPrints) {
  PatternConfig config = OfAbs();
  config.dialect = gcode::Dialect::kRepRapFirmware;
  config.start_gcode = "T1\n" + config.start_gcode;
  EXPECT_TRUE(HasLine(GcodeOf(config), "M572 D1 S0.06"));
  EXPECT_FALSE(GcodeOf(config).find("M572 D0") != std::string::npos);
  config.extruder_drive = 3;
  EXPECT_TRUE(HasLine(GcodeOf(config), "M572 D3 S0.06"));
  config.extruder_drive = -1;
  config.start_gcode = "M98 P\"start.g\"\n";
  const auto problem = FindProblem(config);
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->key, "extruder_drive");
  config.dialect = gcode::Dialect::kMarlin;
  EXPECT_FALSE(FindProblem(config));
}

TEST(PatternGcode, EveryMotorOnTheFilamentIsSetBeforeEachLine) {
  PatternConfig config = OfAbs();
  config.advance_motors = {"extruder", "belted"};
  const std::string gcode = GcodeOf(config);
  EXPECT_TRUE(gcode.find("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.06\n"
                         "SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.06\n") !=
              std::string::npos);
  EXPECT_FALSE(gcode.find("SET_PRESSURE_ADVANCE ADVANCE=") != std::string::npos);
}

TEST(PatternGcode, IsNeverWrittenWithoutATemperature) {
  const PatternConfig config;
  EXPECT_THROW((void)GcodeOf(config), Bug);
}

TEST(PatternGcode, OfThePaperIsAsRecorded) {
  const std::string path = TRAMMEL_GOLDEN_DIR "/pattern_klipper.gcode";
  std::ifstream file(path);
  std::stringstream recorded;
  recorded << file.rdbuf();
  EXPECT_EQ(GcodeOf(OfAbs()), recorded.str())
      << "if the change is meant, write " << path
      << " anew with: trammel pa pattern --material abs --force --out";
}

}  // namespace
}  // namespace trammel::pressure_advance
