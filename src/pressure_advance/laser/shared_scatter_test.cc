#include "pressure_advance/laser/shared_scatter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

namespace trammel::pressure_advance {
namespace {

LineProfile LineOf(std::initializer_list<double> sigmas) {
  LineProfile line;
  for (const double sigma : sigmas) {
    ProfileSample sample;
    sample.area = {0.1, sigma};
    line.samples.push_back(sample);
  }
  return line;
}

constexpr double kExact = 1e-12;

TEST(SharedScatter, DrawsSigmasHalfWayToTheScans) {
  std::vector<LineProfile> lines = {LineOf({1, 1, 1}), LineOf({2, 2, 2}), LineOf({1.5, 2, 3})};
  ShareScatter(lines);
  EXPECT_NEAR(lines[0].samples[0].area.sigma, std::sqrt(2), kExact);
  EXPECT_NEAR(lines[1].samples[0].area.sigma, 2, kExact);
  EXPECT_NEAR(lines[2].samples[2].area.sigma, std::sqrt(6), kExact);
  EXPECT_EQ(lines[0].samples[0].area.value, 0.1);
}

TEST(SharedScatter, LeavesALineThatIsMuchNoisierNearWhereItWas) {
  std::vector<LineProfile> lines = {LineOf({1, 1, 1}), LineOf({1, 1, 1}), LineOf({9, 9, 0.1})};
  ShareScatter(lines);
  EXPECT_NEAR(lines[2].samples[0].area.sigma, 6, kExact);
  EXPECT_NEAR(lines[2].samples[2].area.sigma, 0.15, kExact);
}

TEST(SharedScatter, LeavesAloneWhatIsNotSeen) {
  std::vector<LineProfile> lines = {LineOf({0, 4, 4}), LineOf({}), LineOf({0})};
  ShareScatter(lines);
  EXPECT_EQ(lines[0].samples[0].area.sigma, 0);
  EXPECT_EQ(lines[0].samples[1].area.sigma, 4);
  EXPECT_EQ(lines[2].samples[0].area.sigma, 0);
  std::vector<LineProfile> none;
  ShareScatter(none);
}

}  // namespace
}  // namespace trammel::pressure_advance
