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

// The definition: of all candidates the first with the least median over all points.
TEST(RobustLine, KeepsTheCandidateOfTheLeastMedian) {
  Random random(8);
  std::vector<double> scratch;
  for (int trial = 0; trial < 50; ++trial) {
    const int count = 2 + trial / 2;  // up to as many points as span candidates
    std::vector<double> x, y;
    for (int i = 0; i < count; ++i) {
      x.push_back(i);
      y.push_back(random.Normal() + (random.Normal() > 0.5 ? 20 : 0));
    }
    double least = 1e9;
    std::vector<double> near_line;  // points that the last step is fitted to
    for (int a = 0; a < count; ++a) {
      for (int b = a + 1; b < count; ++b) {
        const double slope = (y[b] - y[a]) / (x[b] - x[a]);
        std::vector<double> residuals;
        for (int i = 0; i < count; ++i) {
          residuals.push_back(std::abs(y[i] - (y[a] - slope * x[a] + slope * x[i])));
        }
        std::vector<double> sorted = residuals;
        std::sort(sorted.begin(), sorted.end());
        if (sorted[count / 2] >= least) continue;
        least = sorted[count / 2];
        near_line.clear();
        for (int i = 0; i < count; ++i) {
          if (residuals[i] <= 3 * 1.4826 * least) near_line.push_back(i);
        }
      }
    }
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const double at : near_line) {
      const auto i = static_cast<std::size_t>(at);
      sx += x[i], sy += y[i], sxx += x[i] * x[i], sxy += x[i] * y[i];
    }
    const auto n = static_cast<double>(near_line.size());
    const RobustLine line = FitRobustLine(x, y, scratch);
    if (n * sxx - sx * sx < 1e-6) continue;
    EXPECT_NEAR(line.slope, (n * sxy - sx * sy) / (n * sxx - sx * sx), 1e-9) << count;
  }
}

}  // namespace
}  // namespace trammel::geometry
