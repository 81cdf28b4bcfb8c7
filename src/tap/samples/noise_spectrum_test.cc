#include "tap/samples/noise_spectrum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace trammel::tap {
namespace {

using ::testing::IsEmpty;

struct Sine {
  double frequency_hz = 0;
  double amplitude_g = 0;
};

/// Taps of which only the flat stretches matter: approach from 0 to 0.9 s, pull-back until 1.4 s,
/// then 0.6 s of rest.
struct World {
  double rate_hz = 320;
  double noise_g = 2;
  std::vector<Sine> sines;
  std::vector<std::vector<double>> times, forces;
  std::vector<Move> moves = {{0, 1, 2, 0, 2, -1},
                             {1, 0, 0, 0, 0, 0},
                             {1.1, 0.001, 0, 300, 0, 1},
                             {1.101, 0.299, 0.3, 0, 0.00015, 1}};

  std::vector<TapView> Taps(int count, Random& random) {
    for (int tap = 0; tap < count; ++tap) {
      auto& time = times.emplace_back();
      auto& force = forces.emplace_back();
      const double phase = random.Uniform(0, 6.28);
      for (double t = 0; t < 2; t += 1 / rate_hz) {
        double value = -2000 + 5 * t + noise_g * random.Normal();
        for (const Sine& sine : sines) {
          value +=
              sine.amplitude_g * std::sin(2 * std::numbers::pi * sine.frequency_hz * t + phase);
        }
        time.push_back(t);
        force.push_back(value);
      }
    }
    std::vector<TapView> taps;
    for (std::size_t i = 0; i < times.size(); ++i) taps.push_back({times[i], forces[i], moves});
    return taps;
  }
};

TEST(NoiseSpectrum, FindsALineWithItsFrequencyAndAmplitude) {
  Random random(11);
  World world;
  world.sines = {{37.3, 1.5}};
  const NoiseSpectrum found = FindNoise(world.Taps(6, random));
  ASSERT_EQ(found.lines.size(), 1u);
  // Tolerances: the frequency far better than the resolution. The amplitude to the noise of one bin
  // and to 15 %, the loss of a Hann window between two bins.
  EXPECT_NEAR(found.lines[0].frequency_hz, 37.3, 0.2 * found.resolution_hz);
  EXPECT_NEAR(found.lines[0].amplitude_g, 1.5, 0.25 * 1.5);
  EXPECT_EQ(found.lines[0].source, NoiseSource::kUnknown);
  EXPECT_NEAR(found.noise_g, std::hypot(2, 1.5 / std::numbers::sqrt2), 0.15);
}

TEST(NoiseSpectrum, NamesMainsWithHarmonicsAndAliasesAndHeaterSwitching) {
  Random random(12);
  const struct {
    std::vector<Sine> sines;
    std::vector<NoiseSource> sources;
    int harmonics;
  } rows[] = {// 200 Hz at 320 samples/s is seen at 120 Hz.
              {{{50, 2}, {150, 2}, {200, 2}}, std::vector(3, NoiseSource::kMains50Hz), 1 + 3 + 4},
              {{{60, 2}, {10, 2}}, {NoiseSource::kHeater10Hz, NoiseSource::kMains60Hz}, 2}};
  for (const auto& row : rows) {
    World world;
    world.sines = row.sines;
    NoiseSpectrum found = FindNoise(world.Taps(6, random));
    std::sort(found.lines.begin(), found.lines.end(), [](const NoiseLine& a, const NoiseLine& b) {
      return a.frequency_hz < b.frequency_hz;
    });
    ASSERT_EQ(found.lines.size(), row.sources.size());
    int harmonics = 0;
    for (std::size_t i = 0; i < row.sources.size(); ++i) {
      EXPECT_EQ(found.lines[i].source, row.sources[i]) << found.lines[i].frequency_hz;
      harmonics += found.lines[i].harmonic;
    }
    EXPECT_EQ(harmonics, row.harmonics);
  }
}

TEST(NoiseSpectrum, WhiteNoiseHasNoLines) {
  int lines = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(20 + run));
    World world;
    lines += static_cast<int>(FindNoise(world.Taps(3, random)).lines.size());
  }
  // One in a thousand spectra is the design; the threshold's approximation may cost a factor of
  // ten.
  EXPECT_LE(lines, 3);
}

TEST(NoiseSpectrum, HostileTapsGiveNoFrequenciesAndNoHarm) {
  Random random(14);
  World world;
  auto taps = world.Taps(1, random);
  EXPECT_THAT(FindNoise({}).frequency_hz, IsEmpty());
  TapView no_moves = taps[0];
  no_moves.moves = {};
  EXPECT_THAT(FindNoise(std::vector{no_moves}).frequency_hz, IsEmpty());
  for (double& force : world.forces[0]) force = std::nan("");
  EXPECT_THAT(FindNoise(std::vector{taps[0]}).frequency_hz, IsEmpty());
  for (double& force : world.forces[0]) force = 5;
  for (double& time : world.times[0]) time = 0.5;
  EXPECT_THAT(FindNoise(std::vector{taps[0]}).frequency_hz, IsEmpty());
  EXPECT_THAT(FindNoise(std::vector{TapView{}}).frequency_hz, IsEmpty());
}

}  // namespace
}  // namespace trammel::tap
