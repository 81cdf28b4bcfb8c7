// The accuracy study of taps: seeded virtual load cells, both methods beside each other and beside
// the Cramer-Rao bound. Prints the tables that docs/tap.md quotes.
//
// TRAMMEL_TAPS: taps per row, 1000 without it. TRAMMEL_TAPS_SEED: the first seed. Reported figures
// have the default; nothing may be tuned on it, so use one below 1000 for development.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "tap_bound.h"
#include "tap_length_bound.h"
#include "tap_miss_bound.h"
#include "tap_study_answers.h"

namespace trammel {
namespace {

// What is asked of the contact method.
constexpr double kMostOfBound = 1.15;
constexpr double kMostBiasUm = 0.30;
constexpr double kModelledCoverage[] = {0.93, 0.97};
constexpr double kOtherCoverage = 0.90;
constexpr double kMostRefused = 0.02;
constexpr double kMostRefusedOfClean = 0.005;  // noise may look like something soft, by name

// The rows of the published table, the contact laws, then other rates and disturbances.
std::vector<TapRow> Rows() {
  std::vector<TapRow> rows = {
      NamedRow("clean, linear", Demand::kExact, "reference"),
      NamedRow("quadratic, stiffening +50 %", Demand::kExact, "stiffening"),
      NamedRow("quadratic, softening -30 %", Demand::kExact, "softening"),
      NamedRow("drift 20 gf/s", Demand::kExact, "drifting"),
      NamedRow("noise 8 gf, 1 um per sample", Demand::kOther, "noisy"),
  };
  TapRow brief = NamedRow("short press 20 um, 4 gf", Demand::kOther, "reference");
  brief.cell.disturbance.noise_g = 4;
  brief.scene.press_mm = 0.020;
  brief.within_um = 3;
  rows.push_back(brief);
  TapRow slow = NamedRow("80 samples/s, 0.1 mm/s", Demand::kOther, "reference");
  slow.cell.converter.rate_hz = 80;
  slow.scene.motion.pull_back_speed_mm_s = 0.1;
  slow.worst_um = 1.5;
  rows.push_back(slow);
  rows.push_back(NamedRow("power d^1.25", Demand::kOther, "power-1.25"));
  rows.push_back(NamedRow("Hertz d^1.5", Demand::kOther, "hertz"));
  rows.push_back(NamedRow("cubic, stiffening +50 %", Demand::kOther, "cubic"));
  // The cubic law by which a quadratic press is off by 0.4 um.
  TapRow mild = NamedRow("cubic, stiffening +16 %", Demand::kOther, "cubic");
  mild.cell.press.law.share = 0.16;
  rows.push_back(mild);
  TapRow fast = NamedRow("2000 samples/s", Demand::kOther, "reference");
  fast.cell.converter.rate_hz = 2000;
  rows.push_back(fast);
  TapRow hx711 = NamedRow("HX711: 80 samples/s, sinc filter, 0.1 mm/s", Demand::kOther, "slow");
  hx711.scene.motion.pull_back_speed_mm_s = 0.1;
  rows.push_back(hx711);
  TapRow loud = NamedRow("approach noise 8 gf", Demand::kDisturbed, "reference");
  loud.cell.disturbance.approach_noise_g = 8;
  rows.push_back(loud);
  rows.push_back(NamedRow("backlash 4 um", Demand::kDisturbed, "backlash"));
  rows.push_back(NamedRow("elastic friction 4 um", Demand::kDisturbed, "friction"));
  rows.push_back(NamedRow("creep 8 %", Demand::kDisturbed, "creeping"));
  rows.push_back(NamedRow("hum 4 gf at 50 Hz, harmonics", Demand::kDisturbed, "humming"));
  TapRow drawn =
      NamedRow("drawn: any law, onset and rate, 0.8 to 4 gf", Demand::kDisturbed, "reference");
  drawn.draw = [](TapRow& row, Random& random) { row.cell = sim::DrawCellTraits(random); };
  drawn.scene.press_mm = 0;
  rows.push_back(drawn);
  rows.push_back(NamedRow("heater steps 4 gf", Demand::kDisturbed, "heating"));
  return rows;
}

constexpr tap::Method kMethods[] = {tap::Method::kContact, tap::Method::kTwoLine};

void PrintRow(const TapRow& row, const RowAnswers& answers) {
  for (std::size_t m = 0; m < 2; ++m) {
    const TapAnswers& a = answers.of[m];
    fmt::print("| {} | {} | ", m == 0 ? row.name : "", tap::ToString(kMethods[m]));
    if (a.error_um.empty()) {
      fmt::print("- | - | - | - | ");
    } else {
      fmt::print("{:+.2f} ± {:.2f} | {:.2f} | {:.1f} % | {:.2f} | ", Mean(a.error_um),
                 StandardDeviation(a.error_um), a.Worst(), 100 * a.Coverage(),
                 Mean(a.half_width_um));
    }
    fmt::print("{:.1f} % | ", 100 * a.RefusedShare());
    if (m == 1 || a.bound_um.empty()) {
      fmt::print("| ");
    } else {
      fmt::print("{:.2f} | ", Mean(a.bound_um));
    }
    if (m == 0) {
      fmt::print("{:.2f} · {:.2f} · {:.2f}", answers.bound_um[0], answers.bound_um[1],
                 answers.bound_um[2]);
    }
    fmt::print(" | {} |\n", a.Reasons(3));
  }
  std::fflush(stdout);
}

// A press of at most two terms is promised the bound of the model that has two.
double BoundOf(const TapRow& row, const RowAnswers& answers) {
  const sim::ContactKind kind = row.cell.press.law.kind;
  const double fitted_um = Mean(answers.of[0].bound_um);
  const bool curved = kind == sim::ContactKind::kLinear || kind == sim::ContactKind::kQuadratic;
  return curved ? std::min(fitted_um, answers.bound_um[2]) : fitted_um;
}

void Judge(const TapRow& row, const RowAnswers& answers) {
  const TapAnswers& contact = answers.of[0];
  SCOPED_TRACE(row.name);
  const bool exact = row.demand == Demand::kExact;
  if (row.demand != Demand::kDisturbed) {
    EXPECT_LE(contact.RefusedShare(), kMostRefused);
    ASSERT_GE(contact.error_um.size(), 2u);
    EXPECT_LE(StandardDeviation(contact.error_um), kMostOfBound * BoundOf(row, answers));
  }
  if (contact.error_um.empty()) return;
  EXPECT_LE(std::abs(Mean(contact.error_um)), exact ? kMostBiasUm : Mean(contact.half_width_um));
  EXPECT_GE(contact.Coverage(), exact ? kModelledCoverage[0] : kOtherCoverage);
  EXPECT_LE(contact.Coverage(), exact ? kModelledCoverage[1] : 1);
  if (row.worst_um < 1e9) {
    EXPECT_LE(contact.RefusedShare(), kMostRefusedOfClean);
    EXPECT_LE(contact.Worst(), row.worst_um);
  }
  EXPECT_GE(contact.ShareWithin(row.within_um), row.within_um < 1e9 ? 0.99 : 0);
}

TEST(TapStudy, TheBoundsAreThoseOfAFisherMatrixInvertedByHand) {
  // Two unknown lines that meet, evenly sampled over lengths a and b at density n: for a flat
  // baseline and a press of slope k the break's variance tends to (4 / a + 1 / b) s^2 / (n k^2):
  // the press's own line gives 4 / a at its end, the baseline 1 / b.
  std::vector<double> heights_mm;
  for (int i = -4500; i < 9000; ++i) heights_mm.push_back((i + 0.5) * 1e-5);
  const double by_hand_mm = std::sqrt((4 / 0.045 + 1 / 0.09) / 1e5) * 8 / 3500;
  // The sums differ from integrals by parts in 10^4.
  EXPECT_NEAR(ContactBound(heights_mm, 8, {}, {false, 1}), by_hand_mm, 1e-3 * by_hand_mm);
  EXPECT_NEAR(ContactBound(heights_mm, 16, {}, {true, 2}),
              2 * ContactBound(heights_mm, 8, {}, {true, 2}), 1e-9);
}

TEST(TapStudy, TheRatioOfDensitiesMissesAsSeldomAsTheBoundSays) {
  // Taps that are 0.5 or 2 deviations from a smooth press. Left out is the row's contact where the
  // logarithm of the densities' ratio is below a limit, the same for both.
  constexpr double kApart[] = {0.5, 2};
  constexpr double kLimit = 0.3;
  constexpr int kDraws = 200'000;
  Random random(1);
  MissBound bound;
  int left_out = 0;
  int missed = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double d = kApart[i % 2];
    if (i < 2) bound.distance.push_back(d);
    const double smooth = d * random.Normal() - d * d / 2;
    const double toe = d * random.Normal() + d * d / 2;
    left_out += smooth < kLimit;
    missed += toe < kLimit;
  }
  bound.held = 0.95;
  bound.left_out = left_out / static_cast<double>(kDraws);
  constexpr double kChance = 0.005;  // three deviations of either share: 0.0034
  EXPECT_NEAR(bound.LeastMissed(0.93), missed / static_cast<double>(kDraws), kChance);
  // One limit for each distance, so that either leaves out as much, misses more.
  const double by_hand = 0.5 * (NormalShare(NormalQuantile(bound.left_out) - kApart[0]) +
                                NormalShare(NormalQuantile(bound.left_out) - kApart[1]));
  EXPECT_GT(by_hand, bound.LeastMissed(0.93));
}

TEST(TapStudy, TheMissBoundExcusesNoIntervalThatIsTooNarrow) {
  MissBound bound;
  bound.distance = {1.645};
  bound.held = 0.95;
  bound.left_out = 0.95;
  EXPECT_NEAR(bound.LeastMissed(0.93), 0.5, 1e-3);
  bound.left_out = 1;
  EXPECT_NEAR(bound.LeastMissed(0.93), 0.5, 1e-3);
  bound.held = 0.9;
  EXPECT_EQ(bound.LeastMissed(0.93), 0);
  bound = {};
  EXPECT_EQ(bound.LeastMissed(0.93), 0);
}

TEST(TapStudy, TheMissBoundTellsWhatHoldingTheRowsContactCosts) {
  // One press 1.5 deviations and 3 um away: what holds it in 90 % of its taps holds it in
  // Phi(1.282 - 1.5) of the other's, of which 5 % do so now, from an end that is 1 um away.
  MissBound bound;
  bound.distance = {1.5};
  bound.held = 0.95;
  bound.left_out = 0.95;
  bound.half_width_um = 1;
  bound.apart_um = 3;
  EXPECT_NEAR(bound.LeastHolding(0.9), 0.4136, 1e-3);
  EXPECT_NEAR(bound.LeastWidening_um(0.9), 0.5 * (0.4136 - 0.05) * 2, 1e-3);
  EXPECT_TRUE(bound.HiddenByNoise(0.93, 0.9));
  // Of an interval that is too narrow itself, noise is no excuse; nor where 2 % more suffice.
  EXPECT_FALSE(bound.HiddenByNoise(0.96, 0.9));
  MissBound close = bound;
  close.apart_um = 1.1;
  EXPECT_FALSE(close.HiddenByNoise(0.93, 0.9));
  // What misses as seldom as noise allows needs no wider interval.
  EXPECT_NEAR(bound.LeastHolding(1 - bound.LeastMissed(0.9)), 0.05, 1e-3);
  EXPECT_NEAR(bound.LeastWidening_um(1 - bound.LeastMissed(0.9)), 0, 1e-3);
}

TEST(TapStudy, TheLengthBoundIsAtLeastPrattsOfAStraightPress) {
  // The break of a straight press alone is a normal mean with the bound's deviation s, whose
  // interval is at least 2 s (z Phi(z) + phi(z)) long, z = Phi^-1(held). Other presses add to it.
  QuietTap quiet;
  for (int i = -45; i < 55; ++i) quiet.height_mm.push_back((i + 0.5) * 1e-3);
  quiet.noise_g = 2;
  for (const double height : quiet.height_mm) {
    quiet.tap.force_g.push_back(3500 * std::max(0.0, -height));
  }
  const double sd_um = kUmPerMm * ContactBound(quiet.height_mm, 2, {}, {true, 1});
  const double z = NormalQuantile(0.93);
  const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
  const double of_straight_um = sd_um * (z * NormalShare(z) + density);
  const double joint_um = LeastHalfWidthUm(quiet.Press(), 0.93, 0);
  fmt::print("Straight press at 2 gf: half-width at least {:.2f} um where all toes are kept.\n",
             joint_um);
  EXPECT_GT(joint_um, of_straight_um);
  EXPECT_LT(joint_um, 12);  // where an interval is of no use
  // What holds more is longer, and what is refused instead need not be held.
  EXPECT_GT(LeastHalfWidthUm(quiet.Press(), 0.95, 0), joint_um);
  EXPECT_LT(LeastHalfWidthUm(quiet.Press(), 0.93, 0.02), joint_um);
  // All lengths go with the noise, where the toes that it hides are narrower, too.
  quiet.noise_g = 0.02;
  EXPECT_LT(LeastHalfWidthUm(quiet.Press(), 0.93, 0), 0.05 * joint_um);
}

TEST(TapStudy, AToeIsHiddenAmongOthersWhereIntervalsWouldLengthen) {
  MissBound bound;
  EXPECT_FALSE(bound.HiddenAmongOthers());
  bound.joint = {1.05, 1};
  EXPECT_FALSE(bound.HiddenAmongOthers());
  bound.joint = {1.07, 1};
  EXPECT_TRUE(bound.HiddenAmongOthers());
}

TEST(TapStudy, TheMissBoundFindsAnHonestIntervalOnTheNearestSmoothPress) {
  constexpr int kTaps = 60;
  TapRow toe;
  toe.cell.press.law.toe_mm = 0.003;
  toe.cell.press.law.toe_share = 0.1;
  const MissBound hidden = BoundMisses(toe, kTaps, 1, 0.85);
  ASSERT_EQ(hidden.distance.size(), static_cast<std::size_t>(kTaps));
  EXPECT_GT(hidden.held, 0.85);  // 95 %, three deviations of 60
  EXPECT_GT(hidden.left_out, 0.8);
  EXPECT_GT(hidden.LeastMissed(0.85), 0.5);
  toe.cell.press.law.toe_mm = 0.02;
  toe.cell.disturbance.noise_g = 0.2;
  const MissBound plain = BoundMisses(toe, kTaps, 1, 0.85);
  EXPECT_GT(*std::min_element(plain.distance.begin(), plain.distance.end()), 5);
  EXPECT_LT(plain.LeastMissed(0), 1e-3);
}

TEST(TapStudy, ContactKeepsItsPromisesOnEveryRow) {
  const int taps = static_cast<int>(FromEnvironment("TRAMMEL_TAPS", 1000));
  const std::uint64_t seed = FromEnvironment("TRAMMEL_TAPS_SEED", kReportedTapSeed);
  fmt::print(
      "{} taps a row, seeds from {}. Bounds: of all samples since the pull-back's cruise began, 55 "
      "um beyond the break. Errors of the contact's z in um: mean ± standard "
      "deviation; worst; share within the 95 % interval; mean half-width of it.\n\n",
      taps, seed);
  fmt::print(
      "| case | method | error | worst | covered | half-width | refused | bound of the "
      "model fitted | bounds: flat linear · sloped linear · sloped curved | reasons |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  const std::vector<TapRow> rows = Rows();
  std::vector<RowAnswers> answers;
  for (const TapRow& row : rows) {
    answers.push_back(StudyRow(row, taps, seed, kMethods));
    PrintRow(row, answers.back());
  }
  for (std::size_t i = 0; i < rows.size(); ++i) Judge(rows[i], answers[i]);
}

TapRow Faulty(const char* name, void (*change)(TapRow&)) {
  TapRow row;
  row.name = name;
  change(row);
  return row;
}

// Times from the recording's first sample: touch at 0.15 s, stop 0.0225 s later, pull-back from
// 0.593 s, break 0.141 s later, end at 0.906 s.
constexpr double kAtBreakS = 0.733;

std::vector<TapRow> FaultRows() {
  return {
      Faulty("10 % of samples dropped", [](TapRow& r) { r.cell.faults.drop_share = 0.1; }),
      Faulty("50 % of samples dropped", [](TapRow& r) { r.cell.faults.drop_share = 0.5; }),
      Faulty("5 % duplicate times", [](TapRow& r) { r.cell.faults.duplicate_time_share = 0.05; }),
      Faulty("2 % -1 frames, 120 gf offset",
             [](TapRow& r) {
               r.cell.faults.minus_one_share = 0.02;
               r.cell.converter.offset_g = 120;
             }),
      Faulty("stuck 50 ms at the break",
             [](TapRow& r) {
               r.cell.faults.stuck_at_s = kAtBreakS - 0.025;
               r.cell.faults.stuck_s = 0.05;
             }),
      Faulty("gap of 50 ms at the break",
             [](TapRow& r) {
               r.cell.faults.gap_at_s = kAtBreakS - 0.025;
               r.cell.faults.gap_s = 0.05;
             }),
      Faulty("impulse 60 gf in the air", [](TapRow& r) { r.cell.faults.impulse_at_s = 0.05; }),
      Faulty("impulse 60 gf after the break",
             [](TapRow& r) { r.cell.faults.impulse_at_s = kAtBreakS + 0.03; }),
      Faulty("saturated at 100 gf", [](TapRow& r) { r.cell.converter.saturation_g = 100; }),
      Faulty("ooze: blob 40 gf, thread 15 gf",
             [](TapRow& r) {
               r.cell.press.blob_g = 40;
               r.cell.press.thread_g = 15;
             }),
      Faulty("heavy fouling: blob 120 gf, thread 30 gf",
             [](TapRow& r) {
               r.cell.press.blob_g = 120;
               r.cell.press.blob_mm = 0.3;
               r.cell.press.thread_g = 30;
               r.cell.press.thread_mm = 0.08;
             }),
      Faulty("sticking 40 gf", [](TapRow& r) { r.cell.press.stick_g = 40; }),
      Faulty("loose sheet: 20 um at 700 gf/mm",
             [](TapRow& r) {
               r.cell.press.law.sheet_gap_mm = 0.02;
               r.cell.press.law.sheet_stiffness_g_mm = 700;
             }),
      Faulty("hum 20 gf at 60 Hz",
             [](TapRow& r) {
               r.cell.disturbance.hum_g = 20;
               r.cell.disturbance.hum_hz = 60;
             }),
      Faulty("drift 200 gf/s", [](TapRow& r) { r.cell.disturbance.drift_g_s = 200; }),
      Faulty("wander 10 gf in 0.2 s",
             [](TapRow& r) {
               r.cell.disturbance.wander_g = 10;
               r.cell.disturbance.wander_s = 0.2;
             }),
      Faulty("noise 40 gf", [](TapRow& r) { r.cell.disturbance.noise_g = 40; }),
      Faulty("coarse counts: 20 gf", [](TapRow& r) { r.cell.converter.counts_per_g = 0.05; }),
      Faulty("pull-back of 35 um: still pressed",
             [](TapRow& r) {
               r.scene.motion.pull_back_mm = 0.035;
               r.lets_go = false;
             }),
      Faulty("pull-back of 48 um: ends at the break",
             [](TapRow& r) { r.scene.motion.pull_back_mm = 0.048; }),
      Faulty("press of 3 um", [](TapRow& r) { r.scene.press_mm = 0.003; }),
  };
}

TEST(TapStudy, FaultsAreRefusedOrCoveredByTheInterval) {
  const int taps = static_cast<int>(FromEnvironment("TRAMMEL_TAPS", 1000)) / 4 + 1;
  const std::uint64_t seed = FromEnvironment("TRAMMEL_TAPS_SEED", kReportedTapSeed);
  fmt::print(
      "\n{} taps a row, seeds from {}. Of accepted taps: error in um, worst, share within "
      "the 95 % interval.\n\n| fault | method | refused | reasons | error | worst | covered "
      "|\n|---|---|---|---|---|---|---|\n",
      taps, seed);
  for (const TapRow& row : FaultRows()) {
    const RowAnswers answers = StudyRow(row, taps, seed, kMethods);
    for (std::size_t m = 0; m < 2; ++m) {
      const TapAnswers& a = answers.of[m];
      fmt::print("| {} | {} | {:.0f} % | {} | ", m == 0 ? row.name : "", tap::ToString(kMethods[m]),
                 100 * a.RefusedShare(), a.Reasons(3));
      if (a.error_um.empty() || !row.lets_go) {
        fmt::print("{} | - | - |\n", a.error_um.empty() ? "-" : "there is no contact");
      } else {
        fmt::print("{:+.2f} ± {:.2f} | {:.2f} | {:.0f} % |\n", Mean(a.error_um),
                   StandardDeviation(a.error_um), a.Worst(), 100 * a.Coverage());
      }
      EXPECT_EQ(a.taps(), taps);
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace trammel
