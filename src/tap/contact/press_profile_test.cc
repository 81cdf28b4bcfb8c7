#include "tap/contact/press_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "tap/contact/press_test_support.h"

namespace trammel::tap {
namespace {

struct World {
  std::vector<double> y;
  std::vector<double> force;
  std::vector<double> weight;
};

World MakeWorld(std::uint64_t seed, bool weighted) {
  Random random(seed);
  World world;
  constexpr int kSamples = 80;
  for (int i = 0; i < kSamples; ++i) {
    const double y = static_cast<double>(i) / (kSamples - 1);
    const double d = std::max(0.0, 0.45 - y);
    world.y.push_back(y);
    world.force.push_back(20 * y + 200 * d + 150 * d * d + random.Normal(0, 3));
    if (weighted) {
      world.weight.push_back(random.Uniform());
    }
  }
  return world;
}

double SumSquaresByColumns(const World& world, double t, std::size_t order) {
  std::vector<std::vector<double>> columns(2 + order);
  std::vector<double> force;
  for (std::size_t s = 0; s < world.y.size(); ++s) {
    const double root = world.weight.empty() ? 1 : std::sqrt(world.weight[s]);
    columns[0].push_back(root);
    columns[1].push_back(root * world.y[s]);
    for (std::size_t i = 0; i < order; ++i) {
      columns[2 + i].push_back(root *
                               std::pow(std::max(0.0, t - world.y[s]), static_cast<double>(i + 1)));
    }
    force.push_back(root * world.force[s]);
  }
  return test::Unexplained(columns, force);
}

// Sums of 10^6 gf^2 in double, through a third-order elimination: eight digits are left of them.
constexpr double kRounding_g2 = 1e-3;

TEST(PressProfile, IsTheLeastSquaresOfEachOrderAtAnyBreak) {
  for (const bool weighted : {false, true}) {
    const World world = MakeWorld(1000, weighted);
    std::vector<std::byte> memory(1 << 16);
    Workspace workspace(memory);
    const PressProfile profile({world.y, world.force, world.weight}, workspace);
    ASSERT_TRUE(profile.Ready());
    Random random(1001);
    for (int i = 0; i < 200; ++i) {
      const double t = random.Uniform(0.1, 0.95);
      const PressProfile::At at = profile.Evaluate(t);
      for (std::size_t order = 1; order <= PressProfile::kOrders; ++order) {
        EXPECT_NEAR(at.sum_squares[order - 1], SumSquaresByColumns(world, t, order), kRounding_g2)
            << "t = " << t << ", order " << order;
      }
    }
  }
}

}  // namespace
}  // namespace trammel::tap
