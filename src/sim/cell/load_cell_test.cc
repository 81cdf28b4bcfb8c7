#include "sim/cell/load_cell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "base/statistics.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kSurfaceMm = 0.01234;

// A cell without noise that counts finely: half a count is 5e-6 gf.
CellTraits Quiet() {
  CellTraits traits;
  traits.disturbance.noise_g = 0;
  traits.converter.counts_per_g = 1e5;
  return traits;
}
constexpr double kHalfCountG = 0.51e-5;

SimulatedTap Tap(const CellTraits& traits, std::uint64_t seed = 1, double press_mm = 0.045) {
  Random random(seed);
  TapScene scene;
  scene.surface_z_mm = kSurfaceMm;
  scene.press_mm = press_mm;
  return SimulateTap(traits, scene, random);
}

// The force at the last sample before a time.
double ForceBefore(const SimulatedTap& tap, double time_s) {
  std::size_t i = 0;
  while (i + 1 < tap.time_s.size() && tap.time_s[i + 1] <= time_s) ++i;
  return tap.force_g[i];
}

double PullBackStart(const SimulatedTap& tap) { return tap.moves[3].start_time_s; }

// A nozzle that stands in the air: only disturbances act.
NozzleState InTheAir(double) { return {5, 0, 0}; }

std::vector<double> Readings(const CellTraits& traits, int count, std::uint64_t seed = 3) {
  LoadCell cell(traits, 10, Random(seed));
  std::vector<double> readings;
  for (int i = 0; i < count; ++i) readings.push_back(cell.Next(InTheAir).force_g);
  return readings;
}

// Amplitude at a frequency. REQUIRES a whole number of its periods.
double Amplitude(const std::vector<double>& values, double rate_hz, double frequency_hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += values[i] *
           std::polar(1.0, -2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / rate_hz);
  }
  return 2 * std::abs(sum) / static_cast<double>(values.size());
}

TEST(TapMoves, AreThoseOfARecordedTapOfAVoron) {
  // Read off a real tap: 2 mm/s, 350 mm/s^2, from 1.0693 mm down to -0.0283 mm, back 0.1 mm at
  // 0.32 mm/s. The recording has 16 digits.
  constexpr double kAlike = 1e-9;
  const TapMotion motion;
  const auto down = ApproachMoves(motion, 10, 1.0693386581957445, -0.028317591804095654);
  ASSERT_EQ(down.size(), 2u);
  EXPECT_NEAR(down[0].duration_s, 0.005714285714285714, kAlike);
  EXPECT_NEAR(down[1].start_z_mm, 1.0636243724814587, kAlike);
  EXPECT_NEAR(down[1].duration_s, 0.5459709821427772, kAlike);
  const auto up = PullBackMoves(motion, 11, -0.028317591804095654);
  ASSERT_EQ(up.size(), 4u);
  EXPECT_EQ(up[0].duration_s, 0);
  EXPECT_NEAR(up[1].duration_s, 0.0009142857142857144, kAlike);
  EXPECT_NEAR(up[2].start_z_mm, -0.02817130608980994, kAlike);
  EXPECT_NEAR(up[2].duration_s, 0.3115857142857143, kAlike);
  EXPECT_NEAR(up[3].start_z_mm, 0.07153612248161863, kAlike);
  EXPECT_NEAR(StateAt(up, 100).z_mm, -0.028317591804095654 + 0.1, kAlike);
  EXPECT_EQ(StateAt(up, 100).velocity_mm_s, 0);
}

TEST(ContactStiffness, HoldsByHandAndIsInverted) {
  const double k_d = 3500 * 0.045;
  EXPECT_NEAR(ContactForce({}, 0.045), k_d, 1e-9);
  ContactStiffness law;
  law.kind = ContactKind::kQuadratic;
  law.share = 0.5;
  EXPECT_NEAR(ContactForce(law, 0.045), 1.5 * k_d, 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.0225), 0.5 * 1.25 * k_d, 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.09), (1.5 + 2) * k_d, 1e-9);  // along the tangent
  law.kind = ContactKind::kPower;
  law.exponent = 1.5;
  EXPECT_NEAR(ContactForce(law, 0.045 / 4), k_d / 8, 1e-9);
  law.kind = ContactKind::kCubic;
  EXPECT_NEAR(ContactForce(law, 0.0225), 0.5 * 1.125 * k_d, 1e-9);
  law.sheet_gap_mm = 0.02;
  law.sheet_stiffness_g_mm = 700;
  EXPECT_NEAR(ContactForce(law, 0.01), 7, 1e-9);
  EXPECT_NEAR(ContactForce(law, 0.02 + 0.0225), 14 + 0.5 * 1.125 * k_d, 1e-9);
  for (const double force_g : {1e-3, 5.0, 14.0, 75.0, 2000.0}) {
    // 1e-9 mm on at most 10^4 gf/mm.
    EXPECT_NEAR(ContactForce(law, ContactDepth(law, force_g)), force_g, 1e-4);
  }
  EXPECT_EQ(ContactForce(law, -1), 0);
  EXPECT_EQ(ContactDepth(law, -1), 0);
}

TEST(LoadCell, EverySampleOfAQuietTapIsTheLawAtItsDepth) {
  for (const char* name :
       {"reference", "stiffening", "softening", "power-1.25", "hertz", "cubic"}) {
    CellTraits traits = Quiet();
    traits.press.law = CellByName(name)->press.law;
    const SimulatedTap tap = Tap(traits);
    ASSERT_GT(tap.time_s.size(), 300u);
    for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
      const double depth_mm = kSurfaceMm - StateAt(tap.moves, tap.time_s[i]).z_mm;
      EXPECT_NEAR(tap.force_g[i], ContactForce(traits.press.law, depth_mm), kHalfCountG) << name;
    }
  }
}

TEST(LoadCell, WithoutCreepItLetsGoWhereTheSurfaceIsWhateverLawAndOnset) {
  // Interpolated within 1/16 sample at constant speed: exact but for rounding of times near 100 s
  // (1e-14 s on 0.32 mm/s). The elastic onset has exp(-45/4) of its play left: 5e-8 mm.
  constexpr double kAlikeMm = 1e-10;
  constexpr double kFrictionMm = 1e-7;
  for (const std::string& name : CellNames()) {
    const CellTraits traits = *CellByName(name);
    if (traits.press.creep_share > 0) continue;
    const SimulatedTap tap = Tap(traits);
    ASSERT_TRUE(tap.truth.has_value()) << name;
    const bool friction = traits.press.onset == Onset::kCurved;
    EXPECT_NEAR(tap.truth->contact_z_mm, kSurfaceMm, friction ? kFrictionMm : kAlikeMm) << name;
    EXPECT_NEAR(tap.truth->touch_z_mm, kSurfaceMm - traits.press.onset_travel_mm, 1e-6) << name;
    EXPECT_NEAR(StateAt(tap.moves, tap.truth->contact_time_s).z_mm, tap.truth->contact_z_mm,
                kFrictionMm)
        << name;
  }
}

TEST(LoadCell, CreepRelaxesAHeldPressAndLetsGoEarlier) {
  CellTraits traits = Quiet();
  traits.press.creep_share = 0.08;
  traits.press.creep_s = 0.05;  // the dwell of 0.42 s is long
  const SimulatedTap tap = Tap(traits);
  const double full_g = 3500 * 0.045;
  EXPECT_NEAR(ForceBefore(tap, PullBackStart(tap)), full_g * (1 - 0.08), full_g * 0.08 * 0.001);
  EXPECT_GT(tap.truth->peak_force_g, full_g * 0.95);
  ASSERT_TRUE(tap.truth.has_value());
  // A ramp of v into the time constant lags behind by at most share x v x tau.
  EXPECT_LT(tap.truth->contact_z_mm, kSurfaceMm);
  EXPECT_GT(tap.truth->contact_z_mm, kSurfaceMm - 0.08 * 0.32 * 0.05 * 1.1);
  // The force is 0 from there on: a dent does not pull.
  EXPECT_NEAR(ForceBefore(tap, tap.truth->contact_time_s + 0.005), 0, kHalfCountG);
}

TEST(LoadCell, AStuckNozzlePullsUntilItSnapsOff) {
  CellTraits traits = Quiet();
  traits.press.stick_g = 40;
  const SimulatedTap tap = Tap(traits);
  ASSERT_TRUE(tap.truth.has_value());
  EXPECT_NEAR(tap.truth->snap_z_mm - tap.truth->contact_z_mm, 40.0 / 3500, 1e-4);
  const double lowest_g = *std::min_element(tap.force_g.begin(), tap.force_g.end());
  EXPECT_LT(lowest_g, -35);
  EXPECT_GE(lowest_g, -40);
  EXPECT_NEAR(tap.force_g.back(), 0, kHalfCountG);
}

TEST(Converter, AliasesHumAsItsRateAndFilterDo) {
  CellTraits traits = Quiet();
  traits.disturbance.hum_g = 5;
  traits.disturbance.hum_hz = 60;
  traits.converter.rate_hz = 80;
  EXPECT_NEAR(Amplitude(Readings(traits, 80), 80, 20), 5, 1e-3);
  EXPECT_NEAR(Amplitude(Readings(traits, 80), 80, 10), 0, 1e-3);
  // One boxcar of 16 values over 1/80 s at 60 Hz: sin(pi 0.75) / (16 sin(pi 0.75 / 16)).
  traits.converter.filter_order = 1;
  const double gain =
      std::sin(std::numbers::pi * 0.75) / (16 * std::sin(std::numbers::pi * 0.75 / 16));
  std::vector<double> readings = Readings(traits, 84);
  readings.erase(readings.begin(), readings.begin() + 4);
  EXPECT_NEAR(Amplitude(readings, 80, 20), 5 * gain, 1e-3);
  traits.converter.filter_order = 4;
  readings = Readings(traits, 88);
  readings.erase(readings.begin(), readings.begin() + 8);
  EXPECT_NEAR(Amplitude(readings, 80, 20), 5 * std::pow(gain, 4), 1e-3);
  // Harmonics too: 120 Hz is 40 Hz off 80; at half the rate only its phase shows, so 100 Hz here.
  traits.converter.filter_order = 0;
  traits.disturbance.hum_hz = 50;
  traits.disturbance.hum_second = 0.5;
  EXPECT_NEAR(Amplitude(Readings(traits, 80), 80, 30), 5, 1e-3);
  EXPECT_NEAR(Amplitude(Readings(traits, 80), 80, 20), 2.5, 1e-3);
}

TEST(Converter, ARampIsReadLateByItsLatency) {
  CellTraits traits = Quiet();
  traits.disturbance.drift_g_s = 100;
  traits.converter.rate_hz = 80;
  const double at_once_g = Readings(traits, 20).back();
  for (const int order : {1, 2, 4, 5}) {
    traits.converter.filter_order = order;
    const double late_g = at_once_g - Readings(traits, 20).back();
    const double latency_s = LoadCell(traits, 10, Random(3)).latency_s();
    EXPECT_NEAR(late_g, 100 * latency_s, 2 * kHalfCountG);
    EXPECT_NEAR(latency_s, order * 0.5 / 80, 0.07 * order * 0.5 / 80);
  }
}

TEST(Converter, QuantisesSaturatesTurnsRoundAndShifts) {
  CellTraits traits = Quiet();
  traits.converter.counts_per_g = 0.5;
  traits.converter.offset_g = -2000;
  traits.converter.sign = -1;
  traits.converter.saturation_g = 2060;
  const SimulatedTap tap = Tap(traits);
  EXPECT_EQ(tap.force_g.back(), -2000);
  EXPECT_EQ(*std::min_element(tap.force_g.begin(), tap.force_g.end()), -2060);
  for (const double force_g : tap.force_g) EXPECT_EQ(std::remainder(force_g, 2.0), 0);
}

TEST(LoadCell, NoiseIsAsStrongAsSaidAndStrongerOnTheApproach) {
  CellTraits traits;
  traits.disturbance.approach_noise_g = 4;
  // For 4000 values, 1.1 % is one sigma of a standard deviation.
  constexpr int kCount = 4000;
  constexpr double kShare = 0.04;
  EXPECT_NEAR(StandardDeviation(Readings(traits, kCount)), 2, 2 * kShare);
  LoadCell moving(traits, 10, Random(5));
  std::vector<double> readings;
  for (int i = 0; i < kCount; ++i) {
    readings.push_back(moving.Next([](double) -> NozzleState { return {5, -2, 0}; }).force_g);
  }
  EXPECT_NEAR(StandardDeviation(readings), std::hypot(2, 4), std::hypot(2, 4) * kShare);
}

TEST(SimulatedTap, IsNamedByItsSeed) {
  const CellTraits traits;
  EXPECT_EQ(Tap(traits, 7).force_g, Tap(traits, 7).force_g);
  EXPECT_NE(Tap(traits, 7).force_g, Tap(traits, 8).force_g);
  Random random(1);
  const SimulatedTap first = SimulateTap(traits, {}, random);
  EXPECT_NE(first.force_g, SimulateTap(traits, {}, random).force_g);
}

TEST(SimulatedTap, TheTriggerAndItsLatencyDecideThePress) {
  const SimulatedTap tap = Tap(CellTraits{}, 1, 0);
  const double depth_mm = kSurfaceMm - tap.moves[2].start_z_mm;
  // 75 gf are 21.4 um; then 8 ms and up to a sample at 2 mm/s.
  EXPECT_GE(depth_mm, 75.0 / 3500 + 2 * 0.008);
  EXPECT_LE(depth_mm, 75.0 / 3500 + 2 * (0.008 + 1.0 / 320));
}

TEST(CellTraits, DrawnCellsLetGo) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const CellTraits traits = DrawCellTraits(random);
    const SimulatedTap tap = Tap(traits, seed);
    ASSERT_TRUE(tap.truth.has_value()) << "seed " << seed;
    for (const double force_g : tap.force_g) ASSERT_TRUE(std::isfinite(force_g));
  }
  EXPECT_THAT(CellByName("nothing").error().message, HasSubstr("reference"));
}

SimulatedTap LongTap(const CellTraits& traits) {
  Random random(1);
  TapScene scene;
  scene.motion.pull_back_mm = 0.4;
  return SimulateTap(traits, scene, random);
}

// Difference of two cells' readings at the pull-back's samples, with their heights above the bed.
struct Added {
  double gap_mm = 0;
  double force_g = 0;
};

std::vector<Added> AddedOnPullBack(const CellTraits& traits) {
  const SimulatedTap with = LongTap(traits);
  const SimulatedTap without = LongTap(Quiet());
  std::vector<Added> added;
  for (std::size_t i = 0; i < with.time_s.size(); ++i) {
    if (with.time_s[i] < with.moves[4].start_time_s) continue;
    added.push_back(
        {StateAt(with.moves, with.time_s[i]).z_mm, with.force_g[i] - without.force_g[i]});
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
    EXPECT_NEAR(force_g, expected_g, 2 * kHalfCountG) << gap_mm;
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
  double max_g = 0;
  for (int i = 0; i < 1000; ++i) {
    max_g = std::max(max_g, std::abs(mode.Advance(traits, 0, 0, kStepS)));
  }
  // m v w as a weight.
  EXPECT_NEAR(max_g, 200 * 2 * 2 * std::numbers::pi * 10 / 9806.65, 0.01);
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
