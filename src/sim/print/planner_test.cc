#include "sim/print/planner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::sim {
namespace {

constexpr double kExact = 1e-9;  // rounding of a few dozen operations on values below 1e3

Move StraightMove(Position from, Position to, double feed_mm_s, double e_mm = 0) {
  Move move;
  move.from = from;
  move.to = to;
  move.e_mm = e_mm;
  move.feed_mm_s = feed_mm_s;
  move.acceleration_mm_s2 = 3000;
  move.corner_velocity_mm_s = 5;
  move.minimum_cruise_ratio = 0.5;
  return move;
}

TEST(Planner, SlowFastSlowTakesTheClosedFormsTime) {
  const double e_per_mm = 0.045899;
  const std::vector<TimedMove> plan =
      PlanMotion(std::vector<Move>{StraightMove({0, 0, 0}, {7.5, 0, 0}, 5, 7.5 * e_per_mm),
                                   StraightMove({7.5, 0, 0}, {22.5, 0, 0}, 150, 15 * e_per_mm),
                                   StraightMove({22.5, 0, 0}, {30, 0, 0}, 5, 7.5 * e_per_mm)});
  ASSERT_EQ(plan.size(), 3U);
  const TimedMove& fast = plan[1];
  EXPECT_NEAR(fast.start_v_mm_s, 5, kExact);
  EXPECT_NEAR(fast.cruise_v_mm_s, 150, kExact);
  EXPECT_NEAR(fast.accelerate_s, 145.0 / 3000, kExact);  // 48 ms
  const double ramp_mm = (150.0 * 150 - 25) / 6000;      // 3.75 mm
  EXPECT_NEAR(StateAt(fast, fast.start_s + fast.accelerate_s).distance_mm, ramp_mm, kExact);
  EXPECT_NEAR(fast.cruise_s, (15 - 2 * ramp_mm) / 150, kExact);
  const double end_ramp_mm = 25.0 / 6000;
  EXPECT_NEAR(plan[2].duration_s(), (7.5 - end_ramp_mm) / 5 + 5.0 / 3000, kExact);
  EXPECT_NEAR(plan[2].end_s(), 2 * plan[0].duration_s() + fast.duration_s(), kExact);
}

TEST(Planner, PlansALineAsARealKlipperDid) {
  // Klipper 0.13's own trapezoids (motion_report/dump_trapq, recorded for this project) of
  //   G1 X122.5 E0.688 F9000 / G1 X130 E0.344 F300   at 10000 mm/s^2, from rest, and of
  //   G1 X50 Y50 Z0.3 F6000 / G1 X80 E1.2 F600       from (0, 0, 0).
  constexpr double kRecordedTo = 1e-5;  // s; the print's end passed into a lift there
  const auto at_10000 = [](Move move) {
    move.acceleration_mm_s2 = 10000;
    return move;
  };
  const auto line = PlanMotion(
      std::vector<Move>{at_10000(StraightMove({107.5, 100, 0.25}, {122.5, 100, 0.25}, 150, 0.688)),
                        at_10000(StraightMove({122.5, 100, 0.25}, {130, 100, 0.25}, 5, 0.344))});
  EXPECT_NEAR(line[0].accelerate_s, 0.015, kRecordedTo);
  EXPECT_NEAR(line[0].cruise_s, 0.08501, kRecordedTo);
  EXPECT_NEAR(line[0].decelerate_s, 0.0145, kRecordedTo);
  EXPECT_NEAR(line[0].end_v_mm_s, 5, kRecordedTo);
  EXPECT_NEAR(line[1].cruise_s, 1.49975, kRecordedTo);
  const auto approach =
      PlanMotion(std::vector<Move>{at_10000(StraightMove({0, 0, 0}, {50, 50, 0.3}, 100)),
                                   at_10000(StraightMove({50, 50, 0.3}, {80, 50, 0.3}, 10, 1.2))});
  EXPECT_NEAR(approach[0].cruise_s, 0.69716, kRecordedTo);
  EXPECT_NEAR(approach[0].decelerate_s, 0.009, kRecordedTo);
  EXPECT_NEAR(approach[1].start_v_mm_s, 10, kRecordedTo);
  EXPECT_NEAR(approach[1].cruise_s, 2.9995, kRecordedTo);
}

TEST(Planner, CornersPassAtKlippersJunctionSpeeds) {
  const auto corner_speed = [](double turn_rad) {
    const auto plan = PlanMotion(std::vector<Move>{
        StraightMove({0, 0, 0}, {50, 0, 0}, 200),
        StraightMove({50, 0, 0}, {50 + 50 * std::cos(turn_rad), 50 * std::sin(turn_rad), 0}, 200)});
    return plan[1].start_v_mm_s;
  };
  constexpr double kPi = 3.14159265358979;
  EXPECT_NEAR(corner_speed(kPi / 2), 5, 1e-6);
  EXPECT_NEAR(corner_speed(0), 200, 1e-6);
  EXPECT_NEAR(corner_speed(kPi), 0, 1e-6);
  // jd = scv^2 (sqrt(2) - 1) / a; v^2 = jd a s / (1 - s) with s the sine of half the inner angle.
  const double s = std::sin(0.5 * (kPi - kPi / 4));
  EXPECT_NEAR(corner_speed(kPi / 4), std::sqrt(25 * (std::sqrt(2.0) - 1) * s / (1 - s)), 1e-6);
}

TEST(Planner, AnyPathIsContinuousWithinItsLimits) {
  constexpr std::uint64_t kSeed = 5;
  constexpr double kTolerance = 1e-6;
  Random random(kSeed);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Move> moves;
    Position at;
    for (int i = 0; i < 20; ++i) {
      const double reach = std::exp(random.Uniform(-4, 4));
      const Position to{at.x_mm + random.Normal(0, reach), at.y_mm + random.Normal(0, reach), 0};
      moves.push_back(
          StraightMove(at, to, random.Uniform(1, 300), random.Uniform(0, 0.05) * reach));
      at = to;
    }
    const auto plan = PlanMotion(moves);
    for (std::size_t i = 0; i < plan.size(); ++i) {
      const TimedMove& m = plan[i];
      SCOPED_TRACE(testing::Message() << "seed " << kSeed << " trial " << trial << " move " << i);
      ASSERT_LE(m.cruise_v_mm_s, m.move.feed_mm_s + kTolerance);
      ASSERT_GE(m.accelerate_s, -kTolerance);
      ASSERT_GE(m.decelerate_s, -kTolerance);
      const double driven_mm = 0.5 * (m.start_v_mm_s + m.cruise_v_mm_s) * m.accelerate_s +
                               m.cruise_v_mm_s * m.cruise_s +
                               0.5 * (m.cruise_v_mm_s + m.end_v_mm_s) * m.decelerate_s;
      ASSERT_NEAR(driven_mm, m.length_mm, kTolerance);
      ASSERT_NEAR(StateAt(m, m.end_s()).distance_mm, m.length_mm, kTolerance);
      if (i > 0) {
        ASSERT_NEAR(m.start_v_mm_s, plan[i - 1].end_v_mm_s, kTolerance);
        ASSERT_NEAR(m.start_s, plan[i - 1].end_s(), kTolerance);
      }
    }
    EXPECT_NEAR(plan.back().end_v_mm_s, 0, kTolerance);
  }
}

}  // namespace
}  // namespace trammel::sim
