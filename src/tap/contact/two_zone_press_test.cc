#include "tap/contact/two_zone_press.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "tap/contact/break_search.h"
#include "tap/contact/press_test_support.h"

namespace trammel::tap {
namespace {

struct Hollow {
  double t = 0.437;
  double s = 0.213;
  double outer = 60;
  double inner = 300;
  double curve = 0;  // inner zone's curve
  double baseline = 15;
  double noise_g = 0;
};

struct World {
  std::vector<double> y;
  std::vector<double> force;
};

World MakeWorld(const Hollow& hollow, std::uint64_t seed, int samples = 120) {
  Random random(seed);
  World world;
  for (int i = 0; i < samples; ++i) {
    const double y = static_cast<double>(i) / (samples - 1);
    world.y.push_back(y);
    world.force.push_back(5 + hollow.baseline * y + hollow.outer * std::max(0.0, hollow.t - y) +
                          (hollow.inner - hollow.outer) * std::max(0.0, hollow.s - y) +
                          hollow.curve * std::pow(std::max(0.0, hollow.s - y), 2) +
                          random.Normal(0, hollow.noise_g));
  }
  return world;
}

TwoZonePress Fit(const World& world, double t) {
  std::vector<std::byte> memory(1 << 16);
  Workspace workspace(memory);
  const PressProfile profile({world.y, world.force, {}}, workspace);
  EXPECT_TRUE(profile.Ready());
  return FitTwoZones(profile, OuterZone(profile, t));
}

TEST(TwoZonePress, ItsSumsOfSquaresAreThoseOfPlainLeastSquares) {
  Hollow hollow;
  hollow.noise_g = 3;
  const World world = MakeWorld(hollow, 1000);
  std::vector<std::byte> memory(1 << 16);
  Workspace workspace(memory);
  const PressProfile profile({world.y, world.force, {}}, workspace);
  for (const auto& [t, s] : {std::pair{0.437, 0.213}, {0.6, 0.55}, {0.3, 0.1}}) {
    std::vector<std::vector<double>> columns(5);
    for (const double y : world.y) {
      const double e = std::max(0.0, s - y);
      columns[0].push_back(1);
      columns[1].push_back(y);
      columns[2].push_back(std::max(0.0, t - y));
      columns[3].push_back(e);
      columns[4].push_back(e * e);
    }
    const TwoZones at = EvaluateTwoZones(profile, OuterZone(profile, t), s, s);
    constexpr double kRounding = 1e-6;  // for sums of 10^5 gf^2 in moments of the sixth power
    EXPECT_NEAR(at.sum_squares_curved, test::Unexplained(columns, world.force), kRounding);
    columns.pop_back();
    EXPECT_NEAR(at.sum_squares, test::Unexplained(columns, world.force), kRounding);
  }
}

TEST(TwoZonePress, FindsTheKinkOfAHollowSheet) {
  constexpr double kSearched = 4e-3;  // search resolution of the kink, with its effect on slopes
  for (const double inner : {200.0, 300.0, 550.0}) {
    for (const double curve : {0.0, 150.0}) {
      Hollow hollow;
      hollow.inner = inner;
      hollow.curve = curve;
      const TwoZonePress press = Fit(MakeWorld(hollow, 0), hollow.t);
      ASSERT_TRUE(press.found);
      EXPECT_NEAR(press.s, hollow.s, kSearched);
      EXPECT_NEAR(press.outer_slope, hollow.outer, 0.03 * hollow.outer);
      EXPECT_NEAR(press.inner_slope, inner, 0.03 * inner);
    }
  }
}

// The force of a slope that grows from 0 to 1 evenly between u and v.
double Ramp(double y, double u, double v) {
  const double h = std::max(0.0, u - y);
  const double e = std::max(0.0, v - y);
  return (h * h - e * e) / (2 * (u - v));
}

TEST(RoundedKink, ItsSumsOfSquaresAreThoseOfPlainLeastSquares) {
  const World world = MakeWorld({.noise_g = 3}, 1000);
  std::vector<std::byte> memory(1 << 16);
  Workspace workspace(memory);
  const PressProfile profile({world.y, world.force, {}}, workspace);
  const double t = 0.437;
  const std::array<double, 2> u = {0.41, t};
  const std::array<double, 2> v = {0.12, -0.1};  // from inside and outside the samples
  constexpr double kRounding = 1e-6;
  for (std::size_t side = 0; side < u.size(); ++side) {
    const TwoZones at = EvaluateTwoZones(profile, OuterZone(profile, t), u[side], v[side]);
    std::vector<std::vector<double>> columns(4);
    std::vector<double> curve;
    for (const double y : world.y) {
      const double e = std::max(0.0, v[side] - y);
      const double values[] = {1, y, std::max(0.0, t - y), Ramp(y, u[side], v[side])};
      for (std::size_t i = 0; i < columns.size(); ++i) {
        columns[i].push_back(values[i]);
      }
      curve.push_back(e * e);
    }
    EXPECT_NEAR(at.sum_squares, test::Unexplained(columns, world.force), kRounding);
    if (v[side] > 0) {
      columns.push_back(curve);
      EXPECT_NEAR(at.sum_squares_curved, test::Unexplained(columns, world.force), kRounding);
    } else {
      EXPECT_EQ(at.sum_squares_curved, at.sum_squares);
    }
  }
}

TEST(RoundedKink, ExplainsASlopeThatGrowsOverTheOuterZone) {
  constexpr double kSearched = 0.5;  // gf^2 of 120 samples: the width is searched to a thousandth
  World world = MakeWorld({}, 0);
  std::vector<std::byte> memory(1 << 16);
  for (const double rounding : {0.5, 1.0}) {
    const Hollow place;
    const double half = rounding * (place.t - 0.3);
    for (std::size_t i = 0; i < world.y.size(); ++i) {
      const double y = world.y[i];
      world.force[i] =
          7 + 15 * y + 40 * std::max(0.0, place.t - y) + 260 * Ramp(y, 0.3 + half, 0.3 - half);
    }
    Workspace workspace(memory);
    const PressProfile profile({world.y, world.force, {}}, workspace);
    const TwoZonePress rounded = FitTwoZones(profile, OuterZone(profile, place.t), 0, rounding);
    ASSERT_TRUE(rounded.found);
    EXPECT_LT(rounded.sum_squares, kSearched);
    EXPECT_GT(FitTwoZones(profile, OuterZone(profile, place.t)).sum_squares, 10 * kSearched);
    EXPECT_NEAR(rounded.s, 0.3, 4e-3);
    EXPECT_NEAR(rounded.outer_slope, 40, 1.2);
    EXPECT_NEAR(rounded.inner_slope, 300, 9);
  }
}

}  // namespace
}  // namespace trammel::tap
