#include "tap/ensemble/scatter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/random.h"

namespace trammel::tap {
namespace {

constexpr double kClaimed_mm = 0.0005;

/// Taps that scatter as they claim, and besides as `more` says of each, mm.
std::vector<ScatteredTap> Draw(int count, std::uint64_t seed,
                               const std::function<double(int, const ScatteredTap&)>& more) {
  Random random(seed);
  std::vector<ScatteredTap> taps;
  for (int i = 0; i < count; ++i) {
    ScatteredTap tap;
    tap.result = {true, 0, kClaimed_mm, 5.0 * i, 140 + random.Normal(), 100, 100};
    tap.press_force_g = 150 + 10 * random.Normal();
    tap.result.z_mm = kClaimed_mm * random.Normal() + more(i, tap);
    taps.push_back(tap);
  }
  return taps;
}

ScatterCause CauseOf(const std::function<double(int, const ScatteredTap&)>& more) {
  return ExplainScatter(Draw(20, 1, more)).cause;
}

TEST(Scatter, IsNoiseWhereTapsScatterAsTheyClaim) {
  int otherwise = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const Scatter scatter = ExplainScatter(Draw(15, seed, [](int, const auto&) { return 0.0; }));
    if (scatter.cause == ScatterCause::kNoise) {
      EXPECT_EQ(scatter.beyond_mm, 0);
    } else {
      ++otherwise;
    }
  }
  EXPECT_LE(otherwise, 9);  // 3 by the limit; 9 come once in 500 such tests
}

TEST(Scatter, NamesThePatternThatExplainsIt) {
  EXPECT_EQ(
      CauseOf([](int, const ScatteredTap& t) { return 0.003 * (t.result.temperature_c - 140); }),
      ScatterCause::kTemperature);
  EXPECT_EQ(CauseOf([](int i, const auto&) { return 0.0005 * i; }), ScatterCause::kTime);
  EXPECT_EQ(CauseOf([](int i, const auto&) { return i % 2 == 0 ? 0.002 : -0.002; }),
            ScatterCause::kAlternating);
  EXPECT_EQ(CauseOf([](int, const ScatteredTap& t) { return 0.0003 * (t.press_force_g - 150); }),
            ScatterCause::kPressForce);
  EXPECT_EQ(CauseOf([](int i, const auto&) { return 0.004 * std::sin(i * 0.7); }),
            ScatterCause::kWander);
}

TEST(Scatter, WithoutAPatternItIsTheMachines) {
  Random random(7);
  std::vector<ScatteredTap> taps =
      Draw(20, 2, [&](int, const auto&) { return 0.003 * random.Normal(); });
  const Scatter scatter = ExplainScatter(taps);
  EXPECT_EQ(scatter.cause, ScatterCause::kMachine);
  EXPECT_NEAR(scatter.beyond_mm, 0.003, 0.0015);  // 20 taps know a deviation to 16 %, three times
  for (ScatteredTap& tap : taps) tap.press_trimmed = true;
  EXPECT_EQ(ExplainScatter(taps).cause, ScatterCause::kBacklash);
}

TEST(Scatter, PlacesOfABedAreNoScatter) {
  std::vector<ScatteredTap> taps = Draw(40, 3, [](int i, const auto&) { return 0.05 * (i % 8); });
  for (std::size_t i = 0; i < taps.size(); ++i) {
    taps[i].result.x_mm = 10.0 * static_cast<double>(i % 8);
  }
  EXPECT_EQ(ExplainScatter(taps).cause, ScatterCause::kNoise);
}

TEST(Scatter, LeavesOutliersOut) {
  std::vector<ScatteredTap> taps = Draw(20, 4, [](int, const auto&) { return 0.0; });
  taps[7].result.z_mm = 0.05;
  const Scatter scatter = ExplainScatter(taps);
  EXPECT_EQ(scatter.outliers, 1u);
  EXPECT_EQ(scatter.cause, ScatterCause::kNoise);
}

TEST(Scatter, FewTapsCannotTell) {
  EXPECT_EQ(ExplainScatter({}).cause, ScatterCause::kTooFew);
  const auto far = [](int i, const auto&) { return 0.1 * i; };
  const Scatter scatter = ExplainScatter(Draw(4, 5, far));
  EXPECT_EQ(scatter.cause, ScatterCause::kTooFew);
  EXPECT_THAT(scatter.because, testing::HasSubstr("record ten at one place"));
  // One at each of ten places tells nothing, either.
  std::vector<ScatteredTap> mesh = Draw(10, 6, far);
  for (std::size_t i = 0; i < mesh.size(); ++i) mesh[i].result.x_mm = 10.0 * static_cast<double>(i);
  EXPECT_EQ(ExplainScatter(mesh).cause, ScatterCause::kTooFew);
}

}  // namespace
}  // namespace trammel::tap
