#include "part_alignment/procedure/align_route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace trammel::procedure {
namespace {

using Eigen::Vector3d;
using part_alignment::View;
using ::testing::HasSubstr;

View At(double x, double y, double z) { return {{x, y, z}, Eigen::Matrix3d::Identity(), {}}; }

// A block of 500 x 300 mm, 100 mm high, and a camera that hangs 400 mm below the spindle.
RouteOptions Shop() {
  RouteOptions options;
  options.safe_z_mm = 700;
  options.camera_radius_mm = 60;
  options.obstacles = {{{0, 0, 0}, {500, 300, 100}}};
  return options;
}

TEST(RouteThrough, CrossesOnlyAtTheSafeHeightAndEndsThere) {
  const auto way = RouteThrough({-200, -200, 300}, {At(100, 100, 550), At(400, 200, 560)}, Shop());
  ASSERT_TRUE(way) << way.error().message;
  Vector3d last(-200, -200, 300);
  std::vector<int> views;
  for (const Waypoint& point : *way) {
    const bool across = point.spindle_mm.head<2>() != last.head<2>();
    if (across) {
      EXPECT_EQ(point.spindle_mm.z(), 700);
      EXPECT_EQ(last.z(), 700);
    }
    if (point.view >= 0) views.push_back(point.view);
    last = point.spindle_mm;
  }
  EXPECT_THAT(views, ::testing::ElementsAre(0, 1));
  EXPECT_EQ(last, Vector3d(400, 200, 700));
}

TEST(RouteThrough, RefusesAViewInWhichTheCameraTouchesThePart) {
  const auto way = RouteThrough({0, 0, 700}, {At(100, 100, 499)}, Shop());  // lower end at 99
  ASSERT_FALSE(way);
  EXPECT_EQ(way.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(way.error().message, HasSubstr("too near to obstacle 1"));
  EXPECT_TRUE(RouteThrough({0, 0, 700}, {At(100, 100, 501)}, Shop()));
  // Beside the part, by more than the camera's radius.
  EXPECT_TRUE(RouteThrough({0, 0, 700}, {At(100, -61, 450)}, Shop()));
  EXPECT_FALSE(RouteThrough({0, 0, 700}, {At(100, -59, 450)}, Shop()));
}

TEST(RouteThrough, RefusesASafeHeightThatIsNone) {
  RouteOptions options = Shop();
  options.safe_z_mm = 480;  // the camera would cut through the part on its way across
  const auto way = RouteThrough({-200, 150, 480}, {At(700, 150, 470)}, options);
  ASSERT_FALSE(way);
  EXPECT_THAT(way.error().message, HasSubstr("raise the safe height"));
  options = Shop();
  options.travel.high_mm.z() = 690;
  const auto outside = RouteThrough({0, 0, 600}, {At(100, 100, 600)}, options);
  ASSERT_FALSE(outside);
  EXPECT_EQ(outside.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(outside.error().message, HasSubstr("the safe height 700.0 lies outside the travel"));
}

TEST(RouteThrough, RefusesATravelThatIsNoNumberOrTheWrongWayRound) {
  for (const double most : {double{NAN}, -2e6}) {
    RouteOptions options = Shop();
    options.travel.high_mm.y() = most;
    const auto way = RouteThrough({0, 0, 700}, {At(0, 0, 600)}, options);
    ASSERT_FALSE(way) << most;
    EXPECT_EQ(way.error().kind, ErrorKind::kSafety);
    EXPECT_THAT(way.error().message, HasSubstr("the travel reaches from"));
  }
}

TEST(RouteThrough, RefusesWhatCannotBeDriven) {
  RouteOptions options = Shop();
  options.travel.high_mm = {600, 400, 800};
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(601, 0, 600)}, options).error().message,
              HasSubstr("view 1 at X 601.0 Y 0.0 Z 600.0 lies outside the travel"));
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(0, 0, 701)}, options).error().message,
              HasSubstr("above the safe height"));
  View turned = At(0, 0, 600);
  turned.spindle_rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  EXPECT_THAT(RouteThrough({0, 0, 700}, {turned}, options).error().message,
              HasSubstr("turns the spindle"));
  EXPECT_FALSE(RouteThrough({0, 0, NAN}, {At(0, 0, 600)}, options));
  EXPECT_FALSE(RouteThrough({0, 0, 700}, {At(0, NAN, 600)}, options));
  options.obstacles[0].low_mm.x() = 900;
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(0, 0, 600)}, options).error().message,
              HasSubstr("least and then its most"));
}

TEST(RouteThrough, RefusesToSetOutFromWhereTheSpindleCannotBe) {
  for (const Vector3d& start : {Vector3d(0, 0, 1e300), Vector3d(-2e5, 0, 700)}) {
    const auto way = RouteThrough(start, {At(100, 100, 550)}, Shop());
    ASSERT_FALSE(way);
    EXPECT_EQ(way.error().kind, ErrorKind::kSafety);
    EXPECT_THAT(way.error().message, HasSubstr("the spindle stands at X"));
  }
  RouteOptions options = Shop();
  options.travel.high_mm = {600, 400, 800};
  EXPECT_TRUE(RouteThrough({600.005, 0, 800}, {At(100, 100, 550)}, options)) << "at its limit";
  EXPECT_FALSE(RouteThrough({600.5, 0, 800}, {At(100, 100, 550)}, options));
}

}  // namespace
}  // namespace trammel::procedure
