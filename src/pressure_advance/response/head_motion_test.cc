#include "pressure_advance/response/head_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace trammel::pressure_advance {
namespace {

LineMotion QuickLine() { return {{{0.16, 10}, {0.6, 150}, {0.24, 10}}, 25.0, 3000.0}; }

// The head's speed at a place, and steps of time through a line: nothing of it in closed form.
double SpeedAt(const LineMotion& motion, double s) {
  const double rise = motion.segments[0].fraction * *motion.length_mm;
  const double fall = rise + motion.segments[1].fraction * *motion.length_mm;
  if (s <= rise) return motion.segments[0].speed_mm_s;
  if (s >= fall) return motion.segments[2].speed_mm_s;
  const auto from = [&](double v, double way) {
    return std::sqrt(v * v + 2 * *motion.acceleration_mm_s2 * way);
  };
  return std::min({motion.segments[1].speed_mm_s, from(motion.segments[0].speed_mm_s, s - rise),
                   from(motion.segments[2].speed_mm_s, fall - s)});
}

struct Stepped {
  static constexpr double kStep_s = 2e-6;
  double begin_s;
  std::vector<double> position_mm;

  Stepped(const LineMotion& motion, double begin, double end_s) : begin_s(begin) {
    double s =
        motion.segments[0].fraction * *motion.length_mm + begin * motion.segments[0].speed_mm_s;
    for (double t = begin; t < end_s; t += kStep_s) {
      position_mm.push_back(s);
      s += SpeedAt(motion, s + SpeedAt(motion, s) * kStep_s / 2) * kStep_s;
    }
  }
  [[nodiscard]] double At(double time_s) const {
    return position_mm.at(static_cast<std::size_t>(std::lround((time_s - begin_s) / kStep_s)));
  }
};

TEST(HeadMotion, MovesAsTheHeadDoes) {
  for (const LineMotion& motion :
       {QuickLine(), LineMotion{{{0.25, 20}, {0.5, 100}, {0.25, 20}}, 60.0, 1500.0},
        // Too short for its speed; slower behind it than before.
        LineMotion{{{0.25, 20}, {0.5, 300}, {0.25, 5}}, 30.0, 1000.0}}) {
    const HeadMotion head(motion);
    const Stepped stepped(motion, -0.2, head.times_s().back() + 0.01);
    for (std::size_t i = 0; i < head.times_s().size(); ++i) {
      EXPECT_NEAR(head.positions_mm()[i], stepped.At(head.times_s()[i]), 0.003) << i;
    }
    EXPECT_GT(head.positions_mm().back(), *motion.length_mm);
  }
}

TEST(HeadMotion, StepsShortlyAboutChangesOfSpeedAndRises) {
  const HeadMotion head(QuickLine());
  double longest_s = 0;
  for (std::size_t i = 1; i < head.times_s().size(); ++i) {
    const double step_s = head.times_s()[i] - head.times_s()[i - 1];
    EXPECT_GT(step_s, 0);
    longest_s = std::max(longest_s, step_s);
    if (head.times_s()[i] > -0.05 && head.times_s()[i] < 0.2) {
      EXPECT_LT(step_s, 0.003);
    }
  }
  EXPECT_GT(longest_s, 0.01);
}

TEST(HeadMotion, TakesFewCellsHoweverSlowTheHeadIs) {
  const LineMotion creeping{{{0.25, 0.001}, {0.5, 0.1}, {0.25, 0.001}}, 100.0, 1.0};
  const HeadMotion head(creeping);
  EXPECT_LT(head.times_s().size(), 1500U);
  EXPECT_GT(head.times_s().back(), 25000);
}

TEST(HeadMotion, AveragesByATriangle) {
  constexpr double kWidth_s = 0.04;
  const HeadMotion head(QuickLine());
  const HeadMotion::Drive drive = head.Averaged(kWidth_s);
  const Stepped stepped(QuickLine(), -0.2, head.times_s().back() + 0.1);
  for (std::size_t i = 0; i < head.times_s().size(); i += 7) {
    double sum = 0, weights = 0;
    for (double dt = -kWidth_s / 2; dt <= kWidth_s / 2; dt += 2e-5) {
      const double weight = kWidth_s / 2 - std::abs(dt);
      sum += weight * stepped.At(head.times_s()[i] + dt);
      weights += weight;
    }
    EXPECT_NEAR(drive.position_mm[i], sum / weights, 0.003) << head.times_s()[i];
  }
  // Far from any change of speed nothing is to be averaged.
  EXPECT_NEAR(drive.speed_mm_s.front(), 10, 1e-6);
  EXPECT_NEAR(drive.position_mm.back(), head.positions_mm().back(), 1e-6);
}

TEST(HeadMotion, FollowsTheWayWhereNothingIsAveraged) {
  const HeadMotion head(QuickLine());
  const HeadMotion::Drive drive = head.Averaged(0);
  for (std::size_t i = 0; i < head.times_s().size(); ++i) {
    EXPECT_DOUBLE_EQ(drive.position_mm[i], head.positions_mm()[i]);
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
