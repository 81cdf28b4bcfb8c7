#include "geometry/robust_line.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/random.h"

namespace trammel::geometry {
namespace {

TEST(RobustLine, IsExactOnPointsOfALine) {
  std::vector<double> x, y, scratch;
  for (int i = 0; i < 37; ++i) {
    x.push_back(i);
    y.push_back(2.5 - 0.125 * i);
  }
  const RobustLine line = FitRobustLine(x, y, scratch);
  EXPECT_NEAR(line.offset, 2.5, 1e-12);
  EXPECT_NEAR(line.slope, -0.125, 1e-13);
  EXPECT_NEAR(line.median_residual, 0, 1e-12);
}

TEST(RobustLine, IsNotMovedByFortyPercentOfPointsElsewhere) {
  Random random(7);
  std::vector<double> x, y, scratch;
  for (int i = 0; i < 100; ++i) {
    const bool away = i >= 30 && i < 70;
    x.push_back(i);
    y.push_back(10 + 0.05 * i + (away ? -12 : 0) + random.Normal(0, 0.1));
  }
  const RobustLine line = FitRobustLine(x, y, scratch);
  // 60 points with sigma 0.1 fix the middle to 0.013 and the slope to 0.0004.
  EXPECT_NEAR(line.at(50), 12.5, 5 * 0.013);
  EXPECT_NEAR(line.slope, 0.05, 5 * 0.0004);
}

}  // namespace
}  // namespace trammel::geometry
