#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "sim/cell/load_cell.h"

namespace trammel::sim {
namespace {

constexpr double kRoundingG = 0.51e-5;  // half a count

// A cell without noise that counts finely.
CellTraits Quiet() {
  CellTraits traits;
  traits.disturbance.noise_g = 0;
  traits.converter.counts_per_g = 1e5;
  return traits;
}

SimulatedTap Tap(const CellTraits& traits, std::uint64_t seed = 1) {
  Random random(seed);
  TapScene scene;
  scene.motion.pull_back_mm = 0.4;
  return SimulateTap(traits, scene, random);
}

double HeightAt(const SimulatedTap& tap, std::size_t i) {
  return StateAt(tap.moves, tap.time_s[i]).z_mm;
}

// Difference of two cells' readings at the pull-back's samples, with their heights above the bed.
struct Added {
  double gap_mm = 0;
  double force_g = 0;
};

std::vector<Added> AddedOnPullBack(const CellTraits& traits) {
  const SimulatedTap with = Tap(traits);
  const SimulatedTap without = Tap(Quiet());
  std::vector<Added> added;
  for (std::size_t i = 0; i < with.time_s.size(); ++i) {
    if (with.time_s[i] < with.moves[4].start_time_s) continue;
    added.push_back({HeightAt(with, i), with.force_g[i] - without.force_g[i]});
  }
  return added;
}

TEST(PlasticStrand, PullsAfterTheBreakStretchesAndSnaps) {
  CellTraits traits = Quiet();
  traits.press.strand_g = 10;
  traits.press.strand_onset_mm = 0.002;
  traits.press.strand_length_mm = 0.1;
  traits.press.strand_snap_mm = 0.15;
  int pulled = 0;
  for (const auto& [gap_mm, force_g] : AddedOnPullBack(traits)) {
    double expected_g = 0;
    if (gap_mm > 0 && gap_mm < 0.15) {
      expected_g = -10 * (1 - std::exp(-gap_mm / 0.002)) * 0.1 / (0.1 + gap_mm);
      ++pulled;
    }
    EXPECT_NEAR(force_g, expected_g, 2 * kRoundingG) << gap_mm;
  }
  EXPECT_GT(pulled, 100);
}

TEST(StructureMode, AStopSwingsItsMass) {
  DisturbanceTraits traits;
  traits.mode_mass_g = 200;
  traits.mode_hz = 10;
  traits.mode_damping = 1e-4;
  StructureMode mode;
  constexpr double kStepS = 1e-4;
  (void)mode.Advance(traits, 0, 0, kStepS);
  (void)mode.Advance(traits, 0, 2 / kStepS, kStepS);  // from -2 mm/s to rest within the step
  double most_g = 0;
  for (int i = 0; i < 1000; ++i) {
    most_g = std::max(most_g, std::abs(mode.Advance(traits, 0, 0, kStepS)));
  }
  // m v w as a weight.
  EXPECT_NEAR(most_g, 200 * 2 * 2 * std::numbers::pi * 10 / 9806.65, 0.01);
}

TEST(PinkNoise, IsOfUnitStrengthAndOfOneStrengthInEachOctave) {
  PinkNoise pink(320, Random(7));
  constexpr int kSamples = 1 << 18;
  std::vector<double> values;
  for (int i = 0; i < kSamples; ++i) values.push_back(pink.Next());
  // The slowest process forgets within 10 s: 80 independent values of an eighth of the variance.
  EXPECT_NEAR(StandardDeviation(values), 1, 0.1);
  // Means of pairs of blocks differ by what changes within about their length (Haar's wavelet).
  std::vector<double> octave;
  for (int block = 4; block <= 1024; block *= 4) {
    double sum = 0;
    const int pairs = kSamples / (2 * block);
    for (int p = 0; p < pairs; ++p) {
      double difference = 0;
      for (int i = 0; i < block; ++i) {
        difference += values[2 * p * block + i] - values[(2 * p + 1) * block + i];
      }
      sum += std::pow(difference / block, 2);
    }
    octave.push_back(sum / pairs);
  }
  for (const double one : octave) EXPECT_NEAR(one / octave[2], 1, 0.3);
}

}  // namespace
}  // namespace trammel::sim
