#include "gcode/footprint_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trammel::gcode {
namespace {

using ::testing::HasSubstr;

constexpr PlateArea kPlate{0, 0, 250, 200};
constexpr double kLow_mm = 1.2;

Result<Footprint> Read(std::initializer_list<std::string_view> lines, PlateArea plate = kPlate) {
  FootprintReader reader(plate, kLow_mm);
  for (const std::string_view line : lines) {
    if (auto done = reader.Line(line); !done) return tl::unexpected(done.error());
  }
  return std::move(reader).Done();
}

// The same of a print that begins above all that lies there.
Result<Footprint> ReadFromAbove(std::initializer_list<std::string_view> lines,
                                PlateArea plate = kPlate) {
  std::vector<std::string_view> all = {"G1 Z5"};
  all.insert(all.end(), lines.begin(), lines.end());
  FootprintReader reader(plate, kLow_mm);
  for (const std::string_view line : all) {
    if (auto done = reader.Line(line); !done) return tl::unexpected(done.error());
  }
  return std::move(reader).Done();
}

void ExpectBounds(const Result<Footprint>& print, const PlateArea& bounds) {
  ASSERT_TRUE(print.has_value()) << print.error().message;
  const auto seen = print->Bounds();
  ASSERT_TRUE(seen);
  // A cell is 1 mm.
  EXPECT_NEAR(seen->min_x_mm, bounds.min_x_mm, 1);
  EXPECT_NEAR(seen->min_y_mm, bounds.min_y_mm, 1);
  EXPECT_NEAR(seen->max_x_mm, bounds.max_x_mm, 1);
  EXPECT_NEAR(seen->max_y_mm, bounds.max_y_mm, 1);
}

TEST(Footprint, HoldsWhatIsLaidAndNotWhereTheNozzlePassesAbove) {
  const auto print = ReadFromAbove({"G90", "M83", "G1 X200 Y180 Z3 F6000", "G1 E-2 ; retracted",
                                    "G0 X10 Y20", "G1 E2", "G1 X60 Y20 E1.5", "G1 X60 Y70 E1.5",
                                    "G1 X10.5 Y150 E-0.4 ; wipes", "G1 X240 Y10"});
  ExpectBounds(print, {10, 20, 61, 71});
  EXPECT_TRUE(print->Clear({0, 0, 250, 19}));
  EXPECT_TRUE(print->Clear({10, 22, 59, 70}));
  EXPECT_FALSE(print->Clear({10, 22, 60.5, 70}));
  EXPECT_FALSE(print->Clear({30, 0, 31, 20.5}));
}

TEST(Footprint, HoldsWhereTheNozzlePassesLow) {
  const auto print =
      ReadFromAbove({"M83", "G1 X20 Y20", "G1 Z0.2", "G1 X40 E1", "G1 X40 Y100 ; low", "G1 Z1.3",
                     "G1 X200 ; above", "G1 Z0.2 Y150 ; comes down on its way"});
  ExpectBounds(print, {20, 20, 201, 151});
  EXPECT_TRUE(print->Clear({42, 20, 199, 200}));
  EXPECT_FALSE(print->Clear({42, 20, 201, 200}));
}

TEST(Footprint, FollowsRelativeMovesAndAbsoluteFilament) {
  ExpectBounds(ReadFromAbove({"G28", "G1 Z5", "M82", "G92 E", "G1 X100 Y100", "G91", "G1 X20 E1",
                              "g1 y-30 e2", "G1 X-50 E2", "G90", "G92 E0", "G1 X200 E0"}),
               {100, 70, 121, 101});
  ExpectBounds(ReadFromAbove({"N10 G1X20Y30*57", "N11 g01 x40 e.5 (to the right) ;done"}),
               {20, 30, 41, 31});
}

TEST(Footprint, BringsBackTheModesThatWereKept) {
  ExpectBounds(ReadFromAbove({"M83", "G1 X20 Y20", "SAVE_GCODE_STATE NAME=a", "M120", "G91", "M82",
                              "G92 E5", "G1 X10 E6", "RESTORE_GCODE_STATE NAME=a MOVE=0",
                              "G1 X60 E1", "G91", "M121", "G1 Y50 E1"}),
               {20, 20, 61, 51});
}

TEST(Footprint, KeepsModesOneBehindTheOther) {
  ExpectBounds(ReadFromAbove({"M83", "G1 X20 Y20", "M120", "G91", "M120", "G90", "M121",
                              "G1 X30 E1", "M121", "G1 X20 E1"}),
               {20, 20, 51, 21});
}

TEST(Footprint, TakesACarriageReturnForAnEnd) {
  ExpectBounds(ReadFromAbove({"M83", "; begins here\rG1 X20 Y30\rG 01 X60 E1\r"}),
               {20, 30, 61, 31});
}

TEST(Footprint, FollowsArcsByCentreAndByRadius) {
  // Half a circle of 20 mm about (100, 100), over its top and its bottom, and a whole one.
  ExpectBounds(ReadFromAbove({"M83", "G1 X80 Y100", "G2 X120 Y100 I20 E1"}), {80, 100, 121, 121});
  ExpectBounds(ReadFromAbove({"M83", "G1 X80 Y100", "G3 X120 Y100 I20 E1"}), {80, 80, 121, 101});
  ExpectBounds(ReadFromAbove({"M83", "G1 X80 Y100", "G3 I20 E1"}), {80, 80, 121, 121});
  // A quarter of it, and the other three.
  ExpectBounds(ReadFromAbove({"M83", "G1 X80 Y100", "G2 X100 Y120 R20 E1"}), {80, 100, 101, 121});
  ExpectBounds(ReadFromAbove({"M83", "G1 X100 Y120", "G3 X80 Y100 R20 E1"}), {80, 100, 101, 121});
  ExpectBounds(ReadFromAbove({"M83", "G1 X80 Y100", "G3 X100 Y120 R-20 E1"}), {80, 80, 121, 121});
}

TEST(Footprint, LeavesOutWhatLiesBesideThePlate) {
  ExpectBounds(ReadFromAbove(
                   {"M83", "G1 X-5 Y-5", "G1 X300 Y-5 E9 ; primes", "G1 X50 Y-5", "G1 X50 Y30 E1"}),
               {50, 0, 51, 31});
  const auto none = ReadFromAbove({"M83", "G1 X-5 Y-5", "G1 X300 Y-5 E9"});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr("prints nothing on the plate"));
}

TEST(Footprint, TakesAPlateWhoseMiddleIsItsOrigin) {
  const auto print =
      ReadFromAbove({"M83", "G1 X-80 Y-10", "G1 X-70 Y-10 E1"}, PlateArea{-100, -100, 100, 100});
  ExpectBounds(print, {-80, -10, -69, -9});
  EXPECT_TRUE(print->Clear({-60, -100, 100, 100}));
}

// A printer's macros end where they primed, at the left or the front edge.
TEST(Footprint, TakesALowWayFromTheMacrosToBeginAnywhereAtTwoEdges) {
  const auto print =
      Read({"PRINT_START", "G1 Z.2", "M83", "G1 Z.6", "G1 X100 Y80", "G1 Z.2", "G1 X120 E1"});
  ASSERT_TRUE(print) << print.error().message;
  EXPECT_FALSE(print->Clear({40, 40, 42, 42}));
  EXPECT_FALSE(print->Clear({20, 78, 22, 80}));
  EXPECT_FALSE(print->Clear({90, 10, 92, 12}));
  EXPECT_TRUE(print->Clear({125, 85, 250, 200}));
  EXPECT_TRUE(print->Clear({10, 190, 250, 200}));
  // So it is of an axis that is homed amid the print, and of that one alone.
  const auto homed =
      ReadFromAbove({"M83", "G1 X20 Y125", "G28 X", "G1 Z.3", "G1 Y130", "G1 X230 E9"});
  ASSERT_TRUE(homed) << homed.error().message;
  EXPECT_FALSE(homed->Clear({120, 129, 121, 132}));
  EXPECT_TRUE(homed->Clear({10, 150, 240, 200}));
  const auto z = ReadFromAbove({"M83", "G1 X125 Y30", "G28 Z", "G1 Z.3", "G1 Y130", "G1 X230 E9"});
  ASSERT_TRUE(z) << z.error().message;
  EXPECT_FALSE(z->Clear({124, 60, 126, 62}));
  EXPECT_TRUE(z->Clear({0, 0, 120, 200}));
}

// Where the file itself moved before does not say where such a macro ends.
TEST(Footprint, TakesAMacroBeforeTheFirstFilamentToLeaveTheNozzleAnywhere) {
  const auto print = ReadFromAbove({"M83", "G1 X240 Y190", "SET_PRESSURE_ADVANCE ADVANCE=0",
                                    "start_print BED=60", "G1 Z.3", "G1 X100 Y80", "G1 X120 E1"});
  ASSERT_TRUE(print) << print.error().message;
  EXPECT_FALSE(print->Clear({20, 78, 22, 80}));
  EXPECT_FALSE(print->Clear({90, 10, 92, 12}));
  EXPECT_TRUE(print->Clear({125, 85, 250, 200}));
  // Commands that leave it there, and macros amid the print.
  const auto known = ReadFromAbove({"M83", "G1 X100 Y80", "SET_PRESSURE_ADVANCE ADVANCE=0",
                                    "EXCLUDE_OBJECT_DEFINE NAME=a", "G1 Z.3", "G1 X120 E1",
                                    "TIMELAPSE_TAKE_FRAME", "G1 X110 Y82"});
  ASSERT_TRUE(known) << known.error().message;
  EXPECT_TRUE(known->Clear({0, 0, 95, 200}));
}

TEST(Footprint, HoldsWhereTheNozzleComesDownOrProbes) {
  const auto print = ReadFromAbove({"M83", "G1 X125 Y125", "G1 Z0.3", "G1 E30 ; primes", "G1 Z20",
                                    "G1 X200 Y150", "g30 x40 y150", "G1 Z1.5", "G91", "G1 Z-1",
                                    "G1 Z1", "G90", "G1 X20 Y20", "G1 X30 E1"});
  ASSERT_TRUE(print) << print.error().message;
  for (const auto& [x, y] :
       {std::pair{125.0, 125.0}, std::pair{200.0, 150.0}, std::pair{40.0, 150.0}}) {
    EXPECT_FALSE(print->Clear({x - 1, y - 1, x + 1, y + 1})) << x;
  }
  EXPECT_TRUE(print->Clear({130, 100, 195, 200}));
}

TEST(Footprint, RefusesWhatItCannotFollowByItsLine) {
  const struct {
    std::string_view line, why;
  } cases[] = {
      {"G20", "line 2: G20 counts in inches"},
      {"G5 X1 Y1 I1 J1 P0 Q0 E1", "G5 lays splines"},
      {"M605 S2", "copies"},
      {"SET_DUAL_CARRIAGE CARRIAGE=1 MODE=COPY", "copies"},
      {"SET_KINEMATIC_POSITION X=5", "shifts the origin"},
      {"G10 L2 P1 X5", "G10 shifts the origin"},
      {"G53 G1 X5", "G53 moves in other coordinates"},
      {"G55", "G55 chooses other coordinates"},
      {"G61", "G61 moves to a place that was kept"},
      {"G68 X5 Y5 R45", "G68 turns the coordinates"},
      {"G92", "G92 shifts the origin"},
      {"G92.1", "G92.1 shifts the origin"},
      {"M206 X5", "M206 shifts the origin"},
      {"G90 G1 X5", "G90 has another command in its line"},
      {"X230 Y125 E10", "X230 stands without a command"},
      {"G18\nG2 X5 Y6 I1 K1", "stands upright"},
      {"set_gcode_offset z=-2", "shifts the height by more than 0.5 mm"},
      {"SAVE_GCODE_STATE NAME=x\nRESTORE_GCODE_STATE NAME=x MOVE=01", "moves to where the state"},
      {"RESTORE_GCODE_STATE NAME=x",
       "line 2: RESTORE_GCODE_STATE brings back a state that the file did not keep"},
      {"SAVE_GCODE_STATE NAME=x\nrestore_gcode_state name=x move=1", "moves to where the state"},
      {"set_gcode_offset Z=0.1 x_adjust=5", "SET_GCODE_OFFSET shifts the origin"},
      {"G92 X0", "G92 shifts the origin"},
      {"G1 Xnan Y5", "X has no number"},
      {"G1 X1.2.3 Y5", "X1.2.3 is no number"},
      {"G1 X99999999 Y5", "is no number up to 1e6 mm"},
      {"G1 X5 E1", "lays filament at a place that the file does not name"},
  };
  for (const auto& [line, why] : cases) {
    const std::size_t second = line.find('\n');
    const auto print =
        Read({"M83", line.substr(0, second), second == line.npos ? "" : line.substr(second + 1),
              "G1 X5 Y5", "G1 X50 Y5 E1"});
    ASSERT_FALSE(print.has_value()) << line;
    EXPECT_THAT(print.error().message, HasSubstr(std::string(why))) << line;
  }
  EXPECT_TRUE(Read({"SET_GCODE_OFFSET X=0 Z=0.1 MOVE=1", "G92 E0", "PRINT_START BED=60", "T1",
                    "M121", "M605 S1", "G18", "G17", "M117 Layer G1 of M5", "G10", "G11", "G29",
                    "G29 G", "M206 Z0.1", "SET_DUAL_CARRIAGE CARRIAGE=1", "M204 S500", "G1 X5 Y5",
                    "G92 X5", "G1 X50 E1"}));
}

TEST(Footprint, BoundsWhatAHostileFileMayCost) {
  FootprintReader reader(kPlate, kLow_mm);
  ASSERT_TRUE(reader.Line("M83"));
  ASSERT_TRUE(reader.Line("G1 X0 Y0"));
  // Each an arc of 1e6 mm and more about the plate.
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(reader.Line("G2 I-999999 J-999999 E1"));
  }
  EXPECT_TRUE(std::move(reader).Done());
}

}  // namespace
}  // namespace trammel::gcode
