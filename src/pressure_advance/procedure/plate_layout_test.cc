#include "pressure_advance/procedure/plate_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <set>
#include <vector>

#include "base/random.h"
#include "gcode/footprint.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/pattern/pattern_presets.h"

namespace trammel::procedure {
namespace {

using pressure_advance::BoundsMm;
using pressure_advance::PatternConfig;
using settings::ScanSettings;
using ::testing::HasSubstr;

const Reach kReach{{0, 0, 0}, {250, 250, 250}};

PatternConfig One() {
  PatternConfig one;
  one.material = "pla";
  return one;
}

bool Touch(const pressure_advance::BoundsMm& a, const pressure_advance::BoundsMm& b) {
  return a.min_x_mm < b.max_x_mm && b.min_x_mm < a.max_x_mm && a.min_y_mm < b.max_y_mm &&
         b.min_y_mm < a.max_y_mm;
}

TEST(PlateLayout, LaysAsManyPatternsAsAreWantedApartAndWithinReach) {
  for (int count = kFewestPatterns; count <= kMostPatterns; ++count) {
    const auto laid = PatternsBeside(One(), count, {}, kReach);
    ASSERT_TRUE(laid.has_value()) << count << ": " << laid.error().message;
    ASSERT_TRUE(Validate(*laid)) << count;
    const auto layout = LayOut(*laid);
    ASSERT_EQ(layout.patterns.size(), static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < layout.patterns.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        EXPECT_FALSE(Touch(layout.patterns[i], layout.patterns[k])) << count;
      }
    }
    const auto sweeps = PlanSweeps(MakePlan(layout, *laid, ""), {}, {}, kReach);
    ASSERT_TRUE(sweeps.has_value()) << sweeps.error().message;
    std::set<int> swept;
    for (const Sweep& sweep : sweeps->sweeps) swept.insert(sweep.pattern);
    EXPECT_EQ(swept.size(), static_cast<std::size_t>(count));
  }
}

// The middle of the bed is as good as any place, but not where the camera stands beside the nozzle.
TEST(PlateLayout, MovesAsidePatternsThatTheCameraReachesElsewhereAlone) {
  PatternConfig one = One();
  ScanSettings scan;
  scan.camera_offset_x_mm = 90;
  scan.camera_offset_y_mm = 0;
  const auto laid = PatternsBeside(one, 3, scan, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  const auto alone = PatternsBeside(one, 3, {}, kReach);
  ASSERT_TRUE(alone.has_value());
  EXPECT_GT(LayOut(*laid).printed.min_x_mm, LayOut(*alone).printed.min_x_mm);
  EXPECT_TRUE(PlanSweeps(MakePlan(LayOut(*laid), *laid, ""), {}, scan, kReach).has_value());
}

TEST(PlateLayout, KeepsThePlaceThatTheSettingsName) {
  PatternConfig one = One();
  one.position_x_mm = 60;
  one.position_y_mm = 80;
  const auto laid = PatternsBeside(one, 4, {}, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  EXPECT_EQ(laid->position_x_mm, 60);
  EXPECT_EQ(laid->position_y_mm, 80);
  one.position_x_mm = 230;
  EXPECT_FALSE(PatternsBeside(one, 4, {}, kReach).has_value());
}

TEST(PlateLayout, SaysHowManyFit) {
  const Reach small{{0, 0, 0}, {140, 140, 250}};
  const auto laid = PatternsBeside(One(), 9, {}, small);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(laid.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(laid.error().message, HasSubstr("with --repeat"));
  const auto none = PatternsBeside(One(), 2, {}, {{0, 0, 0}, {60, 60, 250}});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr("nor does one"));
}

TEST(PlateLayout, LeavesAGridOfTheSettingsAlone) {
  PatternConfig one = One();
  one.columns = 2;
  const auto laid = PatternsBeside(one, 3, {}, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(laid.error().kind, ErrorKind::kInput);
  EXPECT_THAT(laid.error().message, HasSubstr("columns"));
}

TEST(PlateLayout, SaysWhatIsWrongWithTheScanItself) {
  ScanSettings scan;
  scan.skip_mm = 500;
  const auto laid = PatternsBeside(One(), 2, scan, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_THAT(laid.error().message, HasSubstr("skip"));
}

TEST(PlateLayout, RefinesBesideThePatternWithAsManyLines) {
  PatternConfig one = One();
  one.pressure_advances_s = {0.01, 0.02, 0.03, 0.04, 0.06, 0.07};
  const auto refined = RefinedBeside(one, {0.05, 0.1}, {}, kReach);
  ASSERT_TRUE(refined.has_value()) << refined.error().message;
  ASSERT_TRUE(Validate(*refined));
  const auto layout = LayOut(*refined);
  EXPECT_FALSE(Touch(LayOut(one).printed, layout.printed));
  ASSERT_EQ(layout.lines.size(), 6U);
  EXPECT_EQ(layout.lines.front().pressure_advance_s, 0.05);
  EXPECT_EQ(layout.lines.back().pressure_advance_s, 0.1);
  EXPECT_THAT(WriteGcode(layout, *refined), ::testing::Not(HasSubstr("G28")));
  const auto none = RefinedBeside(one, {0.05, 0.1}, {}, {{0, 0, 0}, {125, 125, 250}});
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr("--refine"));
}

// A print of solid rectangles.
gcode::Footprint PrintOf(std::initializer_list<gcode::PlateArea> areas) {
  gcode::Footprint print({0, 0, 250, 250});
  for (const gcode::PlateArea& area : areas) {
    for (double y = area.min_y_mm; y <= area.max_y_mm; y += 0.5) {
      print.Mark(area.min_x_mm, y, area.max_x_mm, y);
    }
  }
  return print;
}

double ApartBy(const pressure_advance::BoundsMm& a, const gcode::PlateArea& b) {
  return std::max({b.min_x_mm - a.max_x_mm, a.min_x_mm - b.max_x_mm, b.min_y_mm - a.max_y_mm,
                   a.min_y_mm - b.max_y_mm});
}

constexpr double kClear_mm = 6;  // 5, and half of a bead
constexpr double kCell_mm = 1;   // of a footprint, and a step of the search

TEST(PlateLayout, StaysWhereItIsBesideAPrintThatLiesElsewhere) {
  const auto alone = OuterBounds(One());
  const auto laid = PatternsClearOf(PrintOf({{10, 10, 60, 40}}), One(), nullptr, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  EXPECT_NEAR(OuterBounds(*laid).min_x_mm, alone.min_x_mm, 1e-9);
  EXPECT_NEAR(OuterBounds(*laid).min_y_mm, alone.min_y_mm, 1e-9);
}

TEST(PlateLayout, LiesNextToAPrintInTheMiddleAndNotOnIt) {
  const ScanSettings scan;
  for (const ScanSettings* scanned : {&scan, static_cast<const ScanSettings*>(nullptr)}) {
    for (const gcode::PlateArea& part :
         {gcode::PlateArea{100, 60, 150, 180}, gcode::PlateArea{20, 110, 235, 140},
          gcode::PlateArea{120, 120, 121, 121}}) {
      const auto laid = PatternsClearOf(PrintOf({part}), One(), scanned, kReach);
      ASSERT_TRUE(laid.has_value()) << laid.error().message;
      EXPECT_TRUE(Validate(*laid));
      const double apart_mm = ApartBy(OuterBounds(*laid), part);
      EXPECT_GE(apart_mm, kClear_mm - 1e-9);
      EXPECT_LE(apart_mm, kClear_mm + 2 * kCell_mm);
      if (scanned == nullptr) continue;
      const auto sweeps = PlanSweeps(MakePlan(LayOut(*laid), *laid, ""), {}, *scanned, kReach);
      EXPECT_TRUE(sweeps.has_value()) << sweeps.error().message;
    }
  }
}

TEST(PlateLayout, FitsAGridIntoTheRoomThatAPrintLeaves) {
  const auto three = PatternsBeside(One(), 3, {}, kReach);
  ASSERT_TRUE(three.has_value());
  PatternConfig grid = *three;
  grid.position_x_mm = grid.position_y_mm = std::nullopt;
  const gcode::PlateArea part{0, 0, 250, 110};
  const auto laid = PatternsClearOf(PrintOf({part}), grid, nullptr, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  EXPECT_GE(ApartBy(OuterBounds(*laid), part), kClear_mm - 1e-9);
}

TEST(PlateLayout, KeepsThePlaceThatTheSettingsNameOrRefusesIt) {
  PatternConfig one = One();
  one.position_x_mm = 60;
  one.position_y_mm = 80;
  const auto laid = PatternsClearOf(PrintOf({{150, 10, 240, 240}}), one, nullptr, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  EXPECT_EQ(laid->position_x_mm, 60);
  EXPECT_EQ(laid->position_y_mm, 80);
  const auto on_it = PatternsClearOf(PrintOf({{65, 90, 70, 95}}), one, nullptr, kReach);
  ASSERT_FALSE(on_it.has_value());
  EXPECT_THAT(on_it.error().message, HasSubstr("leave position_x and position_y out"));
}

// Where the nearest place lies beside a round bed, another one may do.
TEST(PlateLayout, FindsRoomOnARoundBedWhereThereIsSome) {
  PatternConfig one = One();
  one.bed_shape = settings::BedShape::kEllipse;
  one.columns = 2;
  one.rows = 3;
  const BoundsMm size = OuterBounds(one);
  const double width_mm = size.max_x_mm - size.min_x_mm;
  const double depth_mm = size.max_y_mm - size.min_y_mm;
  Random random(7);
  int found = 0;
  for (int draw = 0; draw < 40; ++draw) {
    std::vector<gcode::PlateArea> parts;
    gcode::Footprint print({0, 0, 250, 250});
    for (int i = 0; i < 3; ++i) {
      const double x = random.Uniform(20, 180);
      const double y = random.Uniform(20, 180);
      parts.push_back({x, y, x + random.Uniform(1, 60), y + random.Uniform(1, 60)});
      for (double at = parts.back().min_y_mm; at < parts.back().max_y_mm; at += 0.5) {
        print.Mark(x, at, parts.back().max_x_mm, at);
      }
    }
    const auto clear = [&](const BoundsMm& bounds, double by_mm) {
      return std::all_of(parts.begin(), parts.end(), [&](const gcode::PlateArea& part) {
        return ApartBy(bounds, part) >= by_mm;
      });
    };
    bool room = false;
    for (double x = 0; x < 250 && !room; x += 4) {
      for (double y = 0; y < 250 && !room; y += 4) {
        PatternConfig there = one;
        there.position_x_mm = x;
        there.position_y_mm = y;
        room = clear({x, y, x + width_mm, y + depth_mm}, kClear_mm + 2 * kCell_mm) &&
               Validate(there).has_value();
      }
    }
    const auto laid = PatternsClearOf(print, one, nullptr, kReach);
    EXPECT_TRUE(laid.has_value() || !room) << draw << ": " << laid.error().message;
    if (!laid) continue;
    ++found;
    EXPECT_TRUE(Validate(*laid)) << draw;
    EXPECT_TRUE(clear(OuterBounds(*laid), kClear_mm - 1e-9)) << draw;
  }
  EXPECT_GT(found, 10);
  EXPECT_LT(found, 40);
}

TEST(PlateLayout, SaysThatAPrintLeavesNoRoom) {
  const auto laid = PatternsClearOf(PrintOf({{20, 20, 230, 230}}), One(), nullptr, kReach);
  ASSERT_FALSE(laid.has_value());
  EXPECT_EQ(laid.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(laid.error().message, HasSubstr("5 mm clear of the print (X 20 to 231, Y 20 to 231"));
}

}  // namespace
}  // namespace trammel::procedure
