#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "tap/judge/quality_checks.h"
#include "tap/samples/finding.h"
#include "tap/samples/lines_test_support.h"

namespace trammel::tap {
namespace {

using test_support::TapDrawing;

constexpr int kTaps = 200;
// Limit: 2 % of the good taps.
constexpr int kMaxRefused = kTaps / 50;

// Result of the checks common to all methods, without a method's own.
struct Checked {
  TapAnalysis result;
  Finding refusal;
};

Checked Check(const RecordedTap& tap, const CheckOptions& options = {}) {
  std::vector<std::byte> memory(CleanWorkspaceBytes(tap.drawn.time_s.size()));
  Workspace workspace(memory);
  TapMotion motion;
  EXPECT_EQ(FindMotion(tap.moves, motion).code, FindingCode::kNone);
  const CleanTap clean = CleanSamples(tap.View(), motion, workspace);
  const TapLines lines = FindTapLines(clean, motion);
  Checked checked;
  checked.refusal = CheckTap(clean, motion, lines, options, checked.result);
  return checked;
}

void ExpectRefusedFor(FindingCode code, const TapDrawing& drawing) {
  std::map<std::string, int> reasons;
  for (int i = 0; i < kTaps; ++i) {
    ++reasons[std::string(Name(Check(Record(drawing, 100 + i)).refusal.code))];
  }
  EXPECT_GE(reasons[std::string(Name(code))], kTaps - kMaxRefused)
      << Name(code) << "; found " << testing::PrintToString(reasons);
}

void ExpectGood(const std::string& what, const TapDrawing& drawing) {
  int refused = 0;
  Finding why;
  for (int i = 0; i < kTaps; ++i) {
    const Checked checked = Check(Record(drawing, 300 + i));
    if (checked.refusal.code != FindingCode::kNone) {
      ++refused;
      why = checked.refusal;
    }
  }
  EXPECT_LE(refused, kMaxRefused) << what << ": " << Explain(why);
}

TEST(TapChecks, RefuseAtMost2PercentOfGoodTaps) {
  const std::map<std::string, TapDrawing> good = [] {
    std::map<std::string, TapDrawing> taps;
    taps["clean"] = {};
    taps["stiffening"].curvature = 0.5;
    taps["softening"].curvature = -0.3;
    taps["drift"].drift_g_s = 20;
    taps["drift the other way"].drift_g_s = -20;
    taps["noise of 8 gf"].noise_g = 8;
    taps["short press"].depth_mm = 0.020;
    taps["short press"].noise_g = 4;
    taps["slow converter"].rate_hz = 80;
    taps["slow converter"].pull_back_mm_s = 0.1;
    taps["press between two samples"] = taps["slow converter"];
    taps["press between two samples"].approach_mm_s = 5;
    taps["fast converter"].rate_hz = 2000;
    taps["fast pull-back"].rate_hz = 1000;
    taps["fast pull-back"].pull_back_mm_s = 1;
    taps["hum"].hum_g = 5;
    taps["noisy approach"].approach_noise_g = 8;
    taps["swinging onset"].onset_ring_g = 30;
    taps["lagging onset"].onset_lag_s = 0.02;
    taps["relaxing by a third"].relaxed = 0.33;
    taps["little plastic"].plastic_mm = 0.05;
    taps["little plastic"].plastic_g = 15;
    taps["little ooze"].pull_g = 8;
    taps["small step of the baseline"].step_g = 10;
    taps["soft bed"].stiffness_g_mm = 500;
    taps["soft bed"].depth_mm = 0.2;
    taps["soft bed"].pull_back_mm = 0.5;
    taps["short approach"].before_s = 0.15;
    taps["long dwell"].dwell_s = 2;
    taps["pushed the other way"].sign = -1;
    taps["far from zero"].tare_g = -2000;
    taps["no noise at all"].noise_g = 0;
    return taps;
  }();
  for (const auto& [what, drawing] : good) {
    ExpectGood(what, drawing);
  }
}

TEST(TapChecks, RefuseEachFaultByItsName) {
  const std::pair<FindingCode, TapDrawing> faults[] = {
      {FindingCode::kNoContact, {.no_contact = true}},
      {FindingCode::kMidAirImpulse, {.impulse_g = 150}},
      {FindingCode::kStillInContact, {.pull_back_mm = 0.035}},
      {FindingCode::kFouledNozzle, {.relaxed = 0.9}},
      {FindingCode::kLowDecompressionForce, {.relaxed = 0.45}},
      {FindingCode::kBaselineForceInconsistent, {.step_g = 25}},
      {FindingCode::kBaselineForceInconsistent, {.step_g = -25}}};
  for (const auto& [code, drawing] : faults) ExpectRefusedFor(code, drawing);
}

TEST(TapChecks, RefuseASlowCollisionWithAnInconsistentBaseline) {
  // The published score lets this one pass.
  TapDrawing drawing;
  drawing.plastic_mm = 0.2;
  drawing.plastic_g = 80;
  drawing.step_g = -10;
  ExpectRefusedFor(FindingCode::kSlowCollision, drawing);
  int passed_score = 0;
  for (int i = 0; i < kTaps; ++i) {
    passed_score += Check(Record(drawing, 100 + i)).result.quality >= kMinScore;
  }
  EXPECT_GT(passed_score, kTaps / 2);
}

TEST(TapChecks, RefuseAStrongPullOfOozeAndNoticeAWeakOne) {
  TapDrawing drawing;
  drawing.pull_g = 40;
  ExpectRefusedFor(FindingCode::kAdhesion, drawing);
  drawing.pull_g = 14;
  int noticed = 0;
  for (int i = 0; i < kTaps; ++i) {
    const Checked checked = Check(Record(drawing, 100 + i));
    noticed += checked.refusal.code == FindingCode::kNone &&
               HasNotice(checked.result, FindingCode::kAdhesion);
  }
  EXPECT_GT(noticed, kTaps / 2);
}

TEST(TapChecks, RefuseAPressBelowTheTriggerForce) {
  CheckOptions options;
  options.trigger_force_g = 200;  // the press is 157 gf
  EXPECT_EQ(Check(Record({}, 100), options).refusal.code, FindingCode::kLowCompressionForce);
  options.trigger_force_g = 75;
  EXPECT_EQ(Check(Record({}, 100), options).refusal.code, FindingCode::kNone);
}

TEST(TapChecks, RefuseALowScore) {
  CheckOptions options;
  options.decompression_angle_rad = 0.4;  // the tap's is 1.35
  const Checked checked = Check(Record({}, 100), options);
  EXPECT_EQ(checked.refusal.code, FindingCode::kLowTapQuality);
  EXPECT_LT(checked.result.quality, kMinScore);
}

TEST(TapChecks, NoticeAHotNozzleDriftAndAShortPress) {
  CheckOptions options;
  options.nozzle_temperature_c = 210;
  EXPECT_TRUE(HasNotice(Check(Record({}, 100), options).result, FindingCode::kHotNozzle));
  options.nozzle_temperature_c = 140;
  EXPECT_FALSE(HasNotice(Check(Record({}, 100), options).result, FindingCode::kHotNozzle));
  TapDrawing drawing;
  drawing.drift_g_s = 40;
  EXPECT_TRUE(HasNotice(Check(Record(drawing, 100)).result, FindingCode::kDrift));
  drawing = {};
  drawing.depth_mm = 0.012;
  EXPECT_TRUE(HasNotice(Check(Record(drawing, 100)).result, FindingCode::kShortPress));
  drawing = {};
  drawing.relaxed = 0.2;
  EXPECT_TRUE(HasNotice(Check(Record(drawing, 100)).result, FindingCode::kLowDecompressionForce));
}

TEST(TapScore, IsTheProductOfItsRatiosAndZeroBeyondTheirLimits) {
  TapShape shape;
  shape.compression_g = 100;
  shape.decompression_rad = 1;
  const double unknown = std::nan("");
  EXPECT_DOUBLE_EQ(Score(shape, unknown), 100);
  shape.approach_ratio = 0.1;
  shape.departure_ratio = 0.2;
  shape.baseline_ratio = 0.05;
  shape.dwell_ratio = 0.3;
  EXPECT_NEAR(Score(shape, unknown), 100 * 0.9 * 0.8 * 0.95 * 0.7, 1e-9);
  EXPECT_NEAR(Score(shape, 0.8), 100 * 0.9 * 0.8 * 0.95 * 0.7 * 0.75, 1e-9);
  shape.departure_ratio = 0.26;
  EXPECT_EQ(Score(shape, unknown), 0);
}

}  // namespace
}  // namespace trammel::tap
