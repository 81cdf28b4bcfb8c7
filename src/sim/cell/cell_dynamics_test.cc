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

TEST(ContactLaw, AToeIsSoftFirstAndLeavesTheLawBehindIt) {
  ContactLaw law;
  law.toe_mm = 0.01;
  law.toe_share = 0.2;
  EXPECT_NEAR(ContactForce(law, 0.005), 0.2 * 3500 * 0.005, 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.030), 3500 * (0.2 * 0.01 + 0.02), 1e-9);
  law.toe_rounding = 0.5;
  EXPECT_NEAR(ContactForce(law, 0.030), 3500 * (0.2 * 0.01 + 0.02), 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.005), 0.2 * 3500 * 0.005, 1e-9);
  // Half way through the rounding the stiffness is half way.
  const double slope = (ContactForce(law, 0.0101) - ContactForce(law, 0.0099)) / 0.0002;
  EXPECT_NEAR(slope, 0.6 * 3500, 1e-6);
  EXPECT_NEAR(ContactDepth(law, ContactForce(law, 0.012)), 0.012, 2e-9);
}

TEST(ContactLaw, AnExponentialToeStiffensFromItsShareToTheLawBehindIt) {
  ContactLaw law;
  law.toe_kind = ToeKind::kExponential;
  law.toe_mm = 0.01;
  law.toe_share = 0.2;
  EXPECT_NEAR(ContactForce(law, 1e-6), 0.2 * 3500 * 1e-6, 1e-6);
  // Where the bed has given way by 4 um, the film of 8 um has by 1 - exp(-2) of that.
  EXPECT_NEAR(ContactForce(law, 0.004 + 0.008 * (1 - std::exp(-2))), 3500 * 0.004, 1e-6);
  EXPECT_NEAR(ContactForce(law, 0.1), 3500 * (0.1 - 0.008), 1e-4);
  EXPECT_NEAR(ContactDepth(law, ContactForce(law, 0.012)), 0.012, 2e-9);
}

TEST(ContactLaw, TwoSlopesMeetAtTheKneeAndAYieldingPressTendsToItsForce) {
  ContactLaw law;
  law.kind = ContactKind::kTwoSlope;
  law.share = 2;
  law.knee = 1.0 / 3;
  EXPECT_NEAR(ContactForce(law, 0.015), 3500 * 0.015, 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.045), 3500 * (0.015 + 3 * 0.030), 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.060), 3500 * (0.015 + 3 * 0.045), 1e-9);
  law.kind = ContactKind::kYielding;
  EXPECT_NEAR(ContactForce(law, 0.030), 3500 * 0.015 * (1 - std::exp(-2.0)), 1e-9);
  law.kind = ContactKind::kPower;
  law.exponent = 0.7;
  EXPECT_NEAR(ContactForce(law, 0.0045), 3500 * 0.045 * std::pow(0.1, 0.7), 1e-9);
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

TEST(Slip, TakesItsForceOnceItsHeightIsPassedOnTheWayUp) {
  CellTraits traits = Quiet();
  traits.disturbance.slip_g = 5;
  traits.disturbance.slip_above_mm = 0.03;
  traits.disturbance.slip_s = 0.001;
  for (const auto& [gap_mm, force_g] : AddedOnPullBack(traits)) {
    if (gap_mm < 0.03) {
      EXPECT_NEAR(force_g, 0, 2 * kRoundingG) << gap_mm;
    } else if (gap_mm > 0.034) {  // more than 10 time constants later
      EXPECT_NEAR(force_g, -5, 1e-3) << gap_mm;
    }
  }
}

TEST(StructureMode, RestsAtTheLoadAndRingsFromAKinkAsAnOscillatorDoes) {
  DisturbanceTraits traits;
  traits.mode_share = 0.3;
  traits.mode_hz = 12;
  traits.mode_damping = 0.01;
  StructureMode mode;
  constexpr double kStepS = 1e-4;
  constexpr double kRateGS = 1000;
  EXPECT_EQ(mode.Advance(traits, 100, 0, kStepS), 0);
  for (int i = 0; i < 1000; ++i) EXPECT_NEAR(mode.Advance(traits, 100, 0, kStepS), 0, 1e-9);
  // A ramp of the load from here on: q - u = -(r / w) sin(w t) without damping.
  const double w = 2 * std::numbers::pi * 12;
  for (int i = 1; i <= 800; ++i) {
    const double t = i * kStepS;
    const double added_g = mode.Advance(traits, 100 - kRateGS * t, 0, kStepS);
    const double undamped_g = 0.3 * kRateGS / w * std::sin(w * t);
    EXPECT_NEAR(added_g, undamped_g, 0.08 * 0.3 * kRateGS / w) << t;
  }
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

TEST(CellMemory, CreepsBackAndKeepsAShareAtHalfThePeak) {
  ConverterTraits traits;
  traits.creep_share = 0.1;
  traits.creep_s = 0.5;
  CellMemory creeping;
  (void)creeping.Advance(traits, 0, 0);
  double shown_g = 0;
  for (int i = 0; i < 500; ++i) shown_g = creeping.Advance(traits, 100, 1e-3);
  EXPECT_NEAR(shown_g, 90 + 10 * (1 - std::exp(-1.0)), 1e-6);
  traits.creep_share = 0;
  traits.hysteresis_share = 0.02;
  CellMemory lagging;
  EXPECT_EQ(lagging.Advance(traits, 50, 1e-3), 50);
  EXPECT_EQ(lagging.Advance(traits, 100, 1e-3), 100);
  EXPECT_NEAR(lagging.Advance(traits, 50, 1e-3), 52, 1e-12);
  EXPECT_EQ(lagging.Advance(traits, 0, 1e-3), 0);
  EXPECT_EQ(lagging.Advance(traits, 50, 1e-3), 50);
}

TEST(Converter, LatencyShiftsItsStampsAndNothingElse) {
  CellTraits late = Quiet();
  late.converter.latency_s = 0.01;
  LoadCell prompt_cell(Quiet(), 10, Random(3));
  LoadCell late_cell(late, 10, Random(3));
  const NozzleAt falling = [](double time_s) { return NozzleState{-time_s * 1e-3, -1e-3, 0}; };
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(late_cell.next_time_s(), prompt_cell.next_time_s() + 0.01, 1e-12);
    const CellSample now = prompt_cell.Next(falling);
    const CellSample then = late_cell.Next(falling);
    EXPECT_EQ(then.counts, now.counts);
    EXPECT_NEAR(then.time_s, now.time_s + 0.01, 1e-12);
  }
  EXPECT_NEAR(late_cell.latency_s() - prompt_cell.latency_s(), 0.01, 1e-12);
}

// Samples in a row through the corruptor; each has a value of its own.
std::vector<CellSample> Corrupted(const SampleFaults& faults, int count) {
  CellTraits traits;
  traits.faults = faults;
  SampleCorruptor corruptor(traits, 0, Random(11));
  std::vector<CellSample> samples;
  for (int i = 0; i < count; ++i) {
    CellSample sample{i / traits.converter.rate_hz, 1.0 * i, i, false};
    if (corruptor.Pass(sample)) samples.push_back(sample);
  }
  return samples;
}

TEST(SampleCorruptor, HoldsTheLastValueForItsShareByChanceOrInTurn) {
  constexpr int kSamples = 4000;
  for (const bool regularly : {false, true}) {
    for (const bool times : {false, true}) {
      SampleFaults faults;
      faults.held_share = 0.6;
      faults.held_regularly = regularly;
      faults.held_times = times;
      const std::vector<CellSample> samples = Corrupted(faults, kSamples);
      int held = 0;
      int longest = 0;
      int run = 0;
      for (std::size_t i = 1; i < samples.size(); ++i) {
        const bool same = samples[i].counts == samples[i - 1].counts;
        held += same;
        run = same ? run + 1 : 0;
        longest = std::max(longest, run);
        EXPECT_EQ(samples[i].time_s == samples[i - 1].time_s, same && times);
      }
      EXPECT_NEAR(held / static_cast<double>(kSamples), 0.6, 0.03);
      EXPECT_EQ(longest <= 2, regularly) << longest;
    }
  }
}

TEST(SampleCorruptor, JitterAndStepMoveTheStamps) {
  SampleFaults faults;
  faults.jitter = 1;
  double most_s = 0;
  std::vector<CellSample> samples = Corrupted(faults, 1000);
  for (int i = 0; i < 1000; ++i) most_s = std::max(most_s, std::abs(samples[i].time_s - i / 320.0));
  EXPECT_LT(most_s, 0.5 / 320);
  EXPECT_GT(most_s, 0.48 / 320);
  faults = {};
  faults.clock_step_at_s = 1;
  faults.clock_step_s = 0.02;
  samples = Corrupted(faults, 640);
  EXPECT_NEAR(samples[319].time_s, 319 / 320.0, 1e-12);
  EXPECT_NEAR(samples[321].time_s, 321 / 320.0 + 0.02, 1e-12);
}

}  // namespace
}  // namespace trammel::sim
