#include "gcode/footprint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>

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
  const auto print =
      Read({"G90", "M83", "G1 X200 Y180 Z3 F6000", "G1 E-2 ; retracted", "G0 X10 Y20", "G1 E2",
            "G1 X60 Y20 E1.5", "G1 X60 Y70 E1.5", "G1 X10.5 Y150 E-0.4 ; wipes", "G1 X240 Y10"});
  ExpectBounds(print, {10, 20, 61, 71});
  EXPECT_TRUE(print->Clear({0, 0, 250, 19}));
  EXPECT_TRUE(print->Clear({10, 22, 59, 70}));
  EXPECT_FALSE(print->Clear({10, 22, 60.5, 70}));
  EXPECT_FALSE(print->Clear({30, 0, 31, 20.5}));
}

TEST(Footprint, HoldsWhereTheNozzlePassesLow) {
  const auto print = Read({"M83", "G1 X20 Y20 Z0.2", "G1 X40 E1", "G1 X40 Y100 ; low", "G1 Z1.3",
                           "G1 X200 ; above", "G1 Z0.2 Y150 ; comes down on its way"});
  ExpectBounds(print, {20, 20, 201, 151});
  EXPECT_TRUE(print->Clear({42, 20, 199, 200}));
  EXPECT_FALSE(print->Clear({42, 20, 201, 200}));
}

TEST(Footprint, FollowsRelativeMovesAndAbsoluteFilament) {
  ExpectBounds(Read({"G28", "M82", "G92 E0", "G1 X100 Y100 Z5", "G91", "G1 X20 E1", "g1 y-30 e2",
                     "G1 X-50 E2", "G90", "G92 E0", "G1 X200 E0"}),
               {100, 70, 121, 101});
  ExpectBounds(Read({"N10 G1X20Y30*57", "N11 g01 x40 e.5 (to the right) ;done"}), {20, 30, 41, 31});
}

TEST(Footprint, BringsBackTheModesThatWereKept) {
  ExpectBounds(Read({"M83", "G1 X20 Y20", "SAVE_GCODE_STATE NAME=a", "M120", "G91", "M82", "G92 E5",
                     "G1 X10 E6", "RESTORE_GCODE_STATE NAME=a MOVE=0", "G1 X60 E1", "G91", "M121",
                     "G1 Y50 E1"}),
               {20, 20, 61, 51});
}

TEST(Footprint, FollowsArcsByCentreAndByRadius) {
  // Half a circle of 20 mm about (100, 100), over its top and its bottom, and a whole one.
  ExpectBounds(Read({"M83", "G1 X80 Y100", "G2 X120 Y100 I20 E1"}), {80, 100, 121, 121});
  ExpectBounds(Read({"M83", "G1 X80 Y100", "G3 X120 Y100 I20 E1"}), {80, 80, 121, 101});
  ExpectBounds(Read({"M83", "G1 X80 Y100", "G3 I20 E1"}), {80, 80, 121, 121});
  // A quarter of it, and the other three.
  ExpectBounds(Read({"M83", "G1 X80 Y100", "G2 X100 Y120 R20 E1"}), {80, 100, 101, 121});
  ExpectBounds(Read({"M83", "G1 X100 Y120", "G3 X80 Y100 R20 E1"}), {80, 100, 101, 121});
  ExpectBounds(Read({"M83", "G1 X80 Y100", "G3 X100 Y120 R-20 E1"}), {80, 80, 121, 121});
}

TEST(Footprint, LeavesOutWhatLiesBesideThePlate) {
  ExpectBounds(
      Read({"M83", "G1 X-5 Y-5", "G1 X300 Y-5 E9 ; primes", "G1 X50 Y-5", "G1 X50 Y30 E1"}),
      {50, 0, 51, 31});
  const auto none = Read({"M83", "G1 X-5 Y-5", "G1 X300 Y-5 E9"});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr("prints nothing on the plate"));
}

TEST(Footprint, TakesAPlateWhoseMiddleIsItsOrigin) {
  const auto print =
      Read({"M83", "G1 X-80 Y-10", "G1 X-70 Y-10 E1"}, PlateArea{-100, -100, 100, 100});
  ExpectBounds(print, {-80, -10, -69, -9});
  EXPECT_TRUE(print->Clear({-60, -100, 100, 100}));
}

TEST(Footprint, RefusesWhatItCannotFollowByItsLine) {
  const struct {
    std::string_view line, why;
  } cases[] = {
      {"G20", "line 2: G20 counts in inches"},
      {"G5 X1 Y1 I1 J1 P0 Q0 E1", "splines"},
      {"M605 S2", "copies"},
      {"RESTORE_GCODE_STATE NAME=x", "line 2: brings back a state that the file did not keep"},
      {"M121", "brings back a state"},
      {"SAVE_GCODE_STATE NAME=x\nrestore_gcode_state name=x move=1", "moves to where a state"},
      {"set_gcode_offset Z=0.1 x_adjust=5", "SET_GCODE_OFFSET shifts X"},
      {"G92 X0", "G92 shifts the origin"},
      {"G1 Xnan Y5", "X is no number"},
      {"G1 X1.2.3 Y5", "X1.2.3 is no number"},
      {"G1 X99999999 Y5", "is no number up to 1e6 mm"},
      {"G1 X5 E1", "lays filament from a place that the file does not name"},
  };
  for (const auto& [line, why] : cases) {
    const std::size_t second = line.find('\n');
    const auto print =
        Read({"M83", line.substr(0, second), second == line.npos ? "" : line.substr(second + 1),
              "G1 X5 Y5", "G1 X50 Y5 E1"});
    ASSERT_FALSE(print.has_value()) << line;
    EXPECT_THAT(print.error().message, HasSubstr(std::string(why))) << line;
  }
  EXPECT_TRUE(Read({"SET_GCODE_OFFSET Z=0.1 MOVE=1", "G92 E0", "PRINT_START BED=60", "T1",
                    "M204 S500", "G1 X5 Y5", "G92 X5", "G1 X50 E1"}));
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
