#include "tap/contact/free_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/statistics.h"
#include "tap/contact/press_test_support.h"

namespace trammel::tap {
namespace {

constexpr int kTaps = 400;

/// A tap that was pressed, with what the fit of a straight press would know of it.
class FreeNoise {
 public:
  FreeNoise(const test::PressWorld& world, std::uint64_t seed)
      : tap_(test::MakePressTap(world, seed)), memory_(1 << 20), workspace_(memory_) {
    EXPECT_EQ(FindMotion(tap_.moves, motion_).code, FindingCode{});
    clean_ = CleanSamples(tap_.View(), motion_, workspace_);
    force_.assign(clean_.samples.force_g.begin(), clean_.samples.force_g.end());
    time_s_.assign(clean_.samples.time_s.begin(), clean_.samples.time_s.end());
    nozzle_ = {tap_.contact_z_mm, 0, world.drift_g_s, 100, 0.1, world.noise_g, {}, false};
    // The samples of the cruise, and what they are off the press.
    const double top_mm = motion_.cruise_end_z_mm - motion_.cruise_start_z_mm;
    for (std::size_t i = 0; i < time_s_.size(); ++i) {
      const double at_s = time_s_[i] + clean_.origin_s;
      if (at_s >= motion_.cruise_start_s && at_s <= motion_.cruise_end_s) {
        const double z_mm = motion_.CruiseZ(at_s);
        y_.push_back((z_mm - motion_.cruise_start_z_mm) / top_mm);
        residual_.push_back(force_[i] + clean_.origin_g - 100 -
                            world.stiffness_g_mm * std::max(0.0, tap_.contact_z_mm - z_mm));
      }
    }
    t_ = (tap_.contact_z_mm - motion_.cruise_start_z_mm) / top_mm;
    const double mean = Mean(residual_);
    for (double& r : residual_) {
      r -= mean;
    }
  }
  FreeNoise(const FreeNoise&) = delete;
  FreeNoise& operator=(const FreeNoise&) = delete;

  [[nodiscard]] double Factor() {
    clean_.samples = {time_s_, force_};
    return FreeNoiseFactor(clean_, motion_, nozzle_, {y_, residual_, t_, nozzle_.noise_g},
                           workspace_);
  }

  // Keeps the samples from … to on the pull-back's clock.
  void Keep(double from_s, double to_s) {
    std::vector<float> times;
    std::vector<float> forces;
    for (std::size_t i = 0; i < time_s_.size(); ++i) {
      if (time_s_[i] >= from_s && time_s_[i] <= to_s) {
        times.push_back(time_s_[i]);
        forces.push_back(force_[i]);
      }
    }
    time_s_ = times;
    force_ = forces;
  }

  void TakeResidual(const FreeNoise& other) {
    y_ = other.y_;
    residual_ = other.residual_;
  }

  [[nodiscard]] double BreakTime() const {
    return motion_.CruiseTime(tap_.contact_z_mm) - clean_.origin_s;
  }
  FreeNozzle& nozzle() { return nozzle_; }

 private:
  test::PressTap tap_;
  std::vector<std::byte> memory_;
  Workspace workspace_;
  TapMotion motion_;
  CleanTap clean_;
  std::vector<float> time_s_;
  std::vector<float> force_;
  FreeNozzle nozzle_;
  std::vector<double> y_;
  std::vector<double> residual_;
  double t_ = 0;
};

// Factors of kTaps taps.
std::vector<double> Factors(const test::PressWorld& world) {
  std::vector<double> factors;
  for (int i = 0; i < kTaps; ++i) {
    factors.push_back(FreeNoise(world, 1000 + i).Factor());
  }
  return factors;
}

TEST(FreeNoise, WhiteNoiseIsWhite) {
  // Each of two stretches fails in one of 200, as samples and as blocks; three deviations of a
  // count of eight are granted.
  const std::vector<double> factors = Factors({});
  const auto failed =
      std::count_if(factors.begin(), factors.end(), [](double factor) { return factor > 1; });
  EXPECT_LE(failed, 4 * kTaps / 200 + 9);
}

TEST(FreeNoise, SlowNoiseIsFound) {
  for (const double memory : {0.5, 0.8, 0.9}) {
    test::PressWorld world;
    world.memory = memory;
    const std::vector<double> factors = Factors(world);
    EXPECT_GT(Quantile(factors, 0.01), 1) << memory;
    // Means of many samples scatter by (1 + memory) / (1 - memory) in variance; of the few in a
    // press, and by how much of it a parabola takes up, at least half of that up to 0.8.
    const double long_run = (1 + memory) / (1 - memory);
    EXPECT_GT(Median(factors), std::min(4.0, 0.5 * long_run)) << memory;
    EXPECT_LT(Median(factors), 1.3 * long_run) << memory;
  }
}

TEST(FreeNoise, SlowNoiseIsFoundWhereTheResidualsShowNone) {
  // As where the fit has taken it up.
  test::PressWorld world;
  for (int i = 0; i < kTaps / 4; ++i) {
    FreeNoise white(world, 1000 + i);
    test::PressWorld slow = world;
    slow.memory = 0.8;
    FreeNoise tap(slow, 1000 + i);
    tap.TakeResidual(white);
    EXPECT_GT(tap.Factor(), 1) << "seed " << 1000 + i;
  }
}

TEST(FreeNoise, WildSamplesDoNotHideIt) {
  // One in fifty is off by 30 to 100 times the noise.
  for (const double memory : {0.5, 0.8}) {
    std::vector<double> ratios;
    for (int i = 0; i < kTaps; ++i) {
      test::PressWorld world;
      world.memory = memory;
      FreeNoise clean(world, 1000 + i);
      const double without = clean.Factor();
      world.outlier_share = 0.02;
      FreeNoise wild(world, 1000 + i);
      wild.TakeResidual(clean);  // the fit forgets wild samples, too
      ratios.push_back(wild.Factor() / without);
    }
    // The size of a wild sample is drawn, too: the noise behind it is another.
    EXPECT_NEAR(Median(ratios), 1, 0.1) << memory;
    EXPECT_GT(Quantile(ratios, 0.02), 1.0 / 4) << memory;
  }
}

TEST(FreeNoise, HumThatWasTakenOutOfTheFitIsTakenOutHere) {
  // A sine that is fitted takes two of some 100 degrees of freedom with it.
  constexpr double kTaken = 0.06;
  for (int i = 0; i < kTaps / 4; ++i) {
    test::PressWorld world;
    FreeNoise quiet(world, 1000 + i);
    world.hum_g = 8;
    FreeNoise humming(world, 1000 + i);
    humming.TakeResidual(quiet);  // the fit's are without it
    quiet.nozzle().correlated = true;
    humming.nozzle().correlated = true;
    humming.nozzle().hum = {50, 8, {true, false, false}};
    const double factor = quiet.Factor();
    EXPECT_NEAR(humming.Factor(), factor, kTaken * factor) << "seed " << 1000 + i;
  }
}

TEST(FreeNoise, ADriftIsNone) {
  test::PressWorld world;
  world.drift_g_s = 20;
  const std::vector<double> factors = Factors(world);
  const auto failed =
      std::count_if(factors.begin(), factors.end(), [](double factor) { return factor > 1; });
  EXPECT_LE(failed, 4 * kTaps / 200 + 9);
}

TEST(FreeNoise, ShortStretchesTellNothing) {
  test::PressWorld world;
  world.memory = 0.9;
  // The recording begins with the pull-back, and the nozzle is free for 15 samples.
  const double free_s = 15 / world.rate_hz;
  constexpr double kClear_mm = 0.01;
  constexpr double kClearSamples = 4;
  for (int i = 0; i < kTaps / 4; ++i) {
    FreeNoise tap(world, 1000 + i);
    tap.nozzle().correlated = true;
    EXPECT_GT(tap.Factor(), 1);
    tap.Keep(0, tap.BreakTime() + kClear_mm / world.pull_back_mm_s + kClearSamples / world.rate_hz +
                    free_s);
    EXPECT_EQ(tap.Factor(), 1) << "seed " << 1000 + i;
  }
}

}  // namespace
}  // namespace trammel::tap
