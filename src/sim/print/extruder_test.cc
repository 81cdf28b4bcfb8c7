#include "sim/print/extruder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/check.h"
#include "sim/laser/laser_test_support.h"
#include "sim/print/printer_traits.h"

namespace trammel::sim {

namespace {

constexpr double kFilamentPerMm = 0.045899;
constexpr double kTauS = 0.036;
constexpr double kSpacingMm = 0.04;

// A single line, long enough that every transition settles: 30 mm slow, 60 fast, 30 slow.
TestPattern LongLine(double advance_s, double smooth_time_s) {
  TestPattern pattern;
  pattern.lines = 1;
  pattern.last_advance_s = advance_s;
  pattern.length_mm = 120;
  pattern.smooth_time_s = smooth_time_s;
  return pattern;
}

struct Trial {
  std::vector<TimedMove> plan;
  std::vector<Stroke> strokes;
  std::vector<double> driven;
  Extrusion extrusion;
};

Trial Extruded(const TestPattern& pattern, const ExtruderOptions& options = {},
               const StorageModel& law = {StorageKind::kLinear, kTauS}) {
  Trial trial;
  const auto program = InterpretGcode(WriteTestPattern(pattern), {});
  EXPECT_TRUE(program);
  trial.plan = PlanMotion(program->moves);
  trial.strokes = FindStrokes(trial.plan);
  trial.driven = DrivenFilament(trial.plan);
  const std::vector<StrokeFlow> flows(trial.strokes.size(), StrokeFlow{law});
  trial.extrusion = Extrude(trial.plan, trial.strokes, trial.driven, flows, options, kSpacingMm);
  return trial;
}

double Sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Filament beyond the even share, between two places of the line.
double Surplus(const StrokeDeposit& deposit, double from_mm, double to_mm) {
  double surplus = 0;
  for (std::size_t i = 0; i < deposit.filament_mm.size(); ++i) {
    const double at_mm = static_cast<double>(i) * deposit.spacing_mm;
    if (at_mm > from_mm && at_mm < to_mm) {
      surplus += deposit.filament_mm[i] - deposit.spacing_mm * kFilamentPerMm;
    }
  }
  return surplus;
}

TEST(DrivenFilament, SumsToTheCommandedFilamentWithAnyAdvance) {
  for (const double advance_s : {0.0, 0.05, 1.0}) {
    const Trial trial = Extruded(LongLine(advance_s, 0.04));
    double commanded_mm = 0;
    for (const TimedMove& timed : trial.plan) commanded_mm += timed.move.e_mm;
    EXPECT_NEAR(Sum(trial.driven), commanded_mm, 1e-9);
  }
}

TEST(DrivenFilament, IsSpeedPlusAdvanceTimesAcceleration) {
  const Trial trial = Extruded(LongLine(0.05, 0.04));
  const auto fast = std::find_if(trial.plan.begin(), trial.plan.end(), [](const TimedMove& m) {
    return m.deposits() && m.cruise_v_mm_s > 100;
  });
  ASSERT_NE(fast, trial.plan.end());
  // Mid-ramp, more than half a kernel (20 ms) from both ends of the 48 ms ramp, the averaging of a
  // straight line changes nothing.
  const double mid_s = fast->start_s + 0.5 * fast->accelerate_s;
  const auto step = static_cast<std::size_t>((mid_s + kLeadS) / kStepS);
  const double centre_s = (static_cast<double>(step) + 0.5) * kStepS - kLeadS;
  const double expected =
      kFilamentPerMm * (StateAt(*fast, centre_s).speed_mm_s + 0.05 * 3000) * kStepS;
  EXPECT_NEAR(trial.driven[step], expected, 1e-6 * expected);
}

TEST(Extruder, TheRightAdvanceWithoutSmoothingGivesAFlatLine) {
  const Trial trial = Extruded(LongLine(kTauS, 0));
  const StrokeDeposit& deposit = trial.extrusion.strokes.at(0);
  const double even_mm = deposit.spacing_mm * kFilamentPerMm;
  // A step of 0.25 ms covers 0.04 mm at full speed; where the speed kinks, one node errs by at most
  // its acceleration within a step: 3000 * 0.25e-3 / 150 = 0.5 % at speed, 15 % at 5 mm/s, there
  // spread over 32 steps per node.
  constexpr double kStepShare = 0.01;
  for (std::size_t i = 20; i + 20 < deposit.filament_mm.size(); ++i) {
    ASSERT_NEAR(deposit.filament_mm[i], even_mm, kStepShare * even_mm) << "node " << i;
  }
}

TEST(Extruder, WithoutAdvanceTheRampFollowsTheFirstOrderLag) {
  // v = v0 + a t gives q = v - a tau (1 - exp(-t / tau)), per mm: q / v.
  const Trial trial = Extruded(LongLine(0, 0));
  const StrokeDeposit& deposit = trial.extrusion.strokes.at(0);
  // A step deposits evenly over its path: its error is second order, (0.25 / 36)^2, but at low
  // speeds a node holds few steps; 1 % covers both after the first 0.5 mm.
  constexpr double kStepShare = 0.01;
  for (std::size_t node = 763; node < 838; ++node) {  // 0.5 to 3.5 mm into the ramp
    const double at_mm = static_cast<double>(node) * deposit.spacing_mm - 30;
    const double v = std::sqrt(25 + 2 * 3000 * at_mm);
    const double t_s = (v - 5) / 3000;
    const double share = (v - 3000 * kTauS * -std::expm1(-t_s / kTauS)) / v;
    ASSERT_NEAR(deposit.filament_mm[node] / (deposit.spacing_mm * kFilamentPerMm), share,
                kStepShare);
  }
}

TEST(Extruder, SurplusOfATransitionIsLagErrorTimesSpeedChange) {
  // 145 mm/s of change; lines settle over 10 mm at 5 mm/s (2 s) and 30 mm at 150 mm/s (0.2 s, 5.5
  // time constants: exp(-5.5) = 0.4 %).
  constexpr double kSettled = 0.01;
  for (const double advance_s : {0.0, 0.02, 0.033}) {
    const Trial trial = Extruded(LongLine(advance_s, 0.04));
    const double expected_mm = (kTauS - advance_s) * 145 * kFilamentPerMm;
    const StrokeDeposit& deposit = trial.extrusion.strokes.at(0);
    EXPECT_NEAR(Surplus(deposit, 20, 70), -expected_mm, kSettled * 145 * kFilamentPerMm * kTauS);
    EXPECT_NEAR(Surplus(deposit, 70, 110), expected_mm, kSettled * 145 * kFilamentPerMm * kTauS);
  }
}

TEST(Extruder, ShearThinningStoresByItsLaw) {
  const StorageModel law =
      ScaledTo({StorageKind::kPower, 1, 0.5}, kTauS, 5 * kFilamentPerMm, 150 * kFilamentPerMm);
  const Trial trial = Extruded(LongLine(0.02, 0.04), {}, law);
  const double expected_mm = (kTauS - 0.02) * 145 * kFilamentPerMm;
  EXPECT_NEAR(Surplus(trial.extrusion.strokes.at(0), 20, 70), -expected_mm, 0.01 * expected_mm);
}

TEST(Extruder, KeepsEveryBitOfFilament) {
  for (const double advance_s : {0.0, 0.036, 0.2}) {
    TestPattern pattern;
    pattern.last_advance_s = advance_s;
    ExtruderOptions options;
    options.slip = 0.02;
    const Trial trial = Extruded(pattern, options);
    double laid_mm =
        trial.extrusion.oozed_mm + trial.extrusion.stored_mm + trial.extrusion.slipped_mm;
    for (const StrokeDeposit& deposit : trial.extrusion.strokes)
      laid_mm += Sum(deposit.filament_mm);
    EXPECT_NEAR(laid_mm, Sum(trial.driven), 1e-9);
    EXPECT_GT(trial.extrusion.slipped_mm, 0);
  }
}

std::vector<StorageModel> AllLaws() {
  return {{StorageKind::kLinear, 0.04, 1, 0, 1},
          {StorageKind::kPower, 0.15, 0.4, 0, 1},
          {StorageKind::kPower, 0.05, 0.85, 0, 1},
          {StorageKind::kTanh, 0.06, 1, 0.7, 1.5},
          {StorageKind::kReciprocal, 0.06, 1, 0.95, 0.3}};
}

TEST(StorageModel, IdealPressureAdvanceIsTheChordOfEachLaw) {
  // Worked by hand between 1 and 4 mm/s.
  const StorageModel linear{StorageKind::kLinear, 0.04, 1, 0, 1};
  EXPECT_NEAR(IdealPressureAdvance(linear, 1, 4), 0.04, 1e-15);
  const StorageModel power{StorageKind::kPower, 0.09, 0.5, 0, 1};
  EXPECT_NEAR(IdealPressureAdvance(power, 1, 4), 0.09 * (2 - 1) / 3, 1e-15);
  const StorageModel tanh_law{StorageKind::kTanh, 0.1, 1, 0.6, 2};
  EXPECT_NEAR(IdealPressureAdvance(tanh_law, 1, 4),
              0.1 * (0.4 * 3 + 0.6 * 2 * (std::tanh(2.0) - std::tanh(0.5))) / 3, 1e-15);
  const StorageModel reciprocal{StorageKind::kReciprocal, 0.1, 1, 0.6, 2};
  EXPECT_NEAR(IdealPressureAdvance(reciprocal, 1, 4),
              0.1 * (0.4 * 3 + 0.6 * 2 * (4.0 / 6 - 1.0 / 3)) / 3, 1e-15);
}

TEST(StorageModel, ScaledToReachesTheWantedTruthAtAnySpeeds) {
  constexpr double kRelative = 1e-12;
  for (const StorageModel& law : AllLaws()) {
    for (const double k_star_s : {1e-4, 0.036, 1.0}) {
      for (const double fast : {0.01, 7.0, 100.0}) {
        const StorageModel scaled = ScaledTo(law, k_star_s, 0.1 * fast, fast);
        EXPECT_NEAR(IdealPressureAdvance(scaled, 0.1 * fast, fast), k_star_s, kRelative * k_star_s);
        EXPECT_NEAR(IdealPressureAdvance(ScaledTo(law, k_star_s, 0, fast), 0, fast), k_star_s,
                    kRelative * k_star_s);
      }
    }
  }
  EXPECT_THROW((void)ScaledTo({}, 0.036, 5, 5), Bug);
  EXPECT_THROW((void)ScaledTo({}, 0, 1, 5), Bug);
}

}  // namespace

}  // namespace trammel::sim
