#include "pressure_advance/procedure/setup_route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace trammel::procedure {
namespace {

using pressure_advance::HeadPlace;
using pressure_advance::MarkReading;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;

constexpr double kExact = 1e-9;
constexpr Reach kReach = {{0, 0, 0}, {250, 250, 240}};

std::string RefusalOf(double low_mm, double high_mm) {
  const auto done = CheckClearHeights({low_mm, high_mm}, {}, kReach);
  return done ? "" : done.error().message;
}

TEST(SetupRoute, HeightsThatAreTooFewOutsideTheReachOrWithoutTheFocusAreNamed) {
  EXPECT_EQ(RefusalOf(12, 25), "");
  EXPECT_THAT(RefusalOf(16, 20), AllOf(HasSubstr("leaves 3.00 mm"), HasSubstr("5 mm are needed")));
  EXPECT_THAT(RefusalOf(25, 12), HasSubstr("the lower height comes first"));
  EXPECT_THAT(RefusalOf(19, 30), HasSubstr("leaves out [camera] focus_height, 17.86 mm"));
  EXPECT_THAT(RefusalOf(12, 300), HasSubstr("0.00 to 240.00 mm"));
  const auto below = CheckClearHeights({-2, 25}, {}, {{0, 0, -5}, {250, 250, 240}});
  ASSERT_FALSE(below);
  EXPECT_EQ(below.error().kind, ErrorKind::kSafety);
}

TEST(SetupRoute, HeightsRiseAndFallWithinWhatIsClearWithTheirApproach) {
  HeadPlace at;
  at.z_mm = 17.86;
  const ClearHeights clear{15, 20};
  const auto places = SweepHeights(at, 4, 1, clear);
  ASSERT_EQ(places.size(), 8U);  // 15.86 to 18.86 mm, twice
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(places[i].from_z, i < 4 ? 1 : -1);
    EXPECT_NEAR(places[i].z_mm, 15.86 + static_cast<double>(i < 4 ? i : 7 - i), kExact);
    EXPECT_TRUE(CheckPlace({125, 125, places[i].z_mm, 0, 0, places[i].from_z}, clear, kReach));
  }
}

TEST(SetupRoute, NoPlaceOutsideOfReachOrClearHeightsPasses) {
  const ClearHeights clear{15, 20};
  EXPECT_TRUE(CheckPlace({125, 125, 17}, clear, kReach));
  for (const HeadPlace& place :
       {HeadPlace{-0.1, 125, 17}, HeadPlace{125, 249.8, 17}, HeadPlace{125, 125, 14.9},
        HeadPlace{125, 125, 20.1}, HeadPlace{125, 125, 15.2, 0, 0, 1}}) {
    const auto done = CheckPlace(place, clear, kReach);
    ASSERT_FALSE(done) << place.x_mm << " " << place.y_mm << " " << place.z_mm;
    EXPECT_EQ(done.error().kind, ErrorKind::kSafety);
  }
}

TEST(SetupRoute, HalfOfTheGridIsReachedFromEitherSideOfEachAxis) {
  const auto places = GridPlaces({100, 80, 17}, 4.5);
  ASSERT_EQ(places.size(), 16U);
  int from_x = 0, from_y = 0;
  double x = 0, y = 0;
  for (const HeadPlace& place : places) {
    from_x += place.from_x, from_y += place.from_y;
    x += place.x_mm / 16, y += place.y_mm / 16;
    EXPECT_LE(std::abs(place.x_mm - 100), 4.5 + kExact);
  }
  EXPECT_EQ(from_x, 0);
  EXPECT_EQ(from_y, 0);
  EXPECT_NEAR(x, 100, kExact);
  EXPECT_NEAR(y, 80, kExact);
}

TEST(SetupRoute, TheMarkComesToThePixelWhicheverWayTheCameraIsTurnedOrMirrored) {
  for (const double turn_rad : {0.0, 0.05, 1.5, 3.14}) {
    for (const double mirror : {1.0, -1.0}) {
      const double c = 40 * std::cos(turn_rad), s = 40 * std::sin(turn_rad);
      const MarkMotion motion{-c * mirror, -s, -s * mirror, c};
      MarkReading seen;
      seen.column_px = 700, seen.row_px = 200;
      const HeadPlace place = BringMark({100, 80, 17}, seen, 640, 360, motion);
      const double dx = place.x_mm - 100, dy = place.y_mm - 80;
      EXPECT_NEAR(700 + dx * motion.column_per_x + dy * motion.column_per_y, 640, 1e-6);
      EXPECT_NEAR(200 + dx * motion.row_per_x + dy * motion.row_per_y, 360, 1e-6);
    }
  }
}

TEST(SetupRoute, FromEveryPlaceOfTheGridTheWholeMarkIsInThePicture) {
  const pressure_advance::MarkShape shape;
  for (const double turn_rad : {0.0, 0.05, std::numbers::pi / 4}) {
    MarkReading seen;
    seen.side_px = 40 * shape.side_mm;
    seen.turn_rad = turn_rad;
    const double half_mm = GridHalf_mm(seen, shape, {1280, 720});
    ASSERT_GT(half_mm, 1);
    const double spread = std::cos(turn_rad) + std::sin(turn_rad);
    EXPECT_LT(40 * spread * (half_mm + shape.side_mm / 2 + shape.bead_mm / 2), 360);
  }
  MarkReading seen;
  seen.side_px = 40 * shape.side_mm;
  EXPECT_LT(GridHalf_mm(seen, shape, {320, 240}), 1) << "too small a picture";
}

TEST(SetupRoute, TheSearchBeginsWhereTheSettingsExpectTheMark) {
  const auto places = SearchPlaces({100, 80, 17}, 8, 5);
  ASSERT_EQ(places.size(), 25U);
  EXPECT_EQ(places[0].x_mm, 100);
  EXPECT_EQ(places[0].y_mm, 80);
  EXPECT_NEAR(std::hypot((places[1].x_mm - 100) / 8, (places[1].y_mm - 80) / 5), 1, kExact);
  EXPECT_EQ(std::abs(places.back().x_mm - 100), 16);
}

TEST(SetupRoute, ThePlateIsLookedAtBesideTheMarkWhereTheHeadReachesIt) {
  pressure_advance::MarkPlan mark;
  mark.x_mm = 139, mark.y_mm = 150, mark.run_in_y_mm = 125;
  const auto behind = PlaceBesideMark(mark, {}, kReach);
  ASSERT_TRUE(behind);
  EXPECT_NEAR(behind->x_mm, 139 - 28, kExact);
  EXPECT_GT(behind->y_mm, 150 - 50.2 + 10);
  const auto in_front = PlaceBesideMark(mark, {}, {{0, 0, 0}, {250, 110, 240}});
  ASSERT_TRUE(in_front);
  EXPECT_LT(in_front->y_mm, 150 - 50.2 - 10);
  const auto nowhere = PlaceBesideMark(mark, {}, {{0, 0, 0}, {100, 250, 240}});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(nowhere.error().message, HasSubstr("--mark-at"));
}

TEST(SetupRoute, MovesAreAbsoluteAndEndAtThePlaceAfterTheApproach) {
  pressure_advance::PatternConfig config;
  EXPECT_EQ(GcodeTo({100, 80, 17.86, 1, -1, 1}, config),
            "G90\nG1 Z17.360 F300\nG1 Z17.860 F300\nG1 X99.500 Y80.500 F9000\n"
            "G1 X100.000 Y80.000 F9000");
  EXPECT_EQ(GcodeTo({100, 80, 17.86}, config), "G90\nG1 Z17.860 F300\nG1 X100.000 Y80.000 F9000");
}

}  // namespace
}  // namespace trammel::procedure
