// The advice of `trammel tap tune` on virtual cells: 20 taps of each are recorded under a middling
// setting; the advice drawn from them is then followed on the same cell.
//
// TRAMMEL_CELLS: cells, 50 without it. TRAMMEL_TAPS_SEED: the first seed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/statistics.h"
#include "tap/tuning/tuning.h"
#include "tap_study_answers.h"

namespace trammel {
namespace {

constexpr int kRecorded = 20;
constexpr int kFollowed = 60;
constexpr double kLeastGood = 0.95;
constexpr double kMostWider = 0.05;   // of the cells that change
constexpr double kWorseAtMost = 1.1;  // median half-widths of 60 taps scatter by a few percent

double LogUniform(Random& random, double lo, double hi) {
  return lo * std::pow(hi / lo, random.Uniform());
}

enum class Setting {
  kMiddling,  // what printers come with
  kPoor,      // presses lightly, pulls back fast and hardly further than the press
};

// A cell that somebody has.
TapRow DrawCell(std::uint64_t seed, Setting setting) {
  Random random(seed);
  TapRow row;
  row.name = fmt::format("{}", seed);
  sim::CellTraits& cell = row.cell;
  sim::ContactLaw& law = cell.press.law;
  law.stiffness_g_mm = LogUniform(random, 500, 8000);
  law.reference_mm = 150 / law.stiffness_g_mm;
  law.kind = random.Uniform() < 0.5 ? sim::ContactKind::kLinear : sim::ContactKind::kQuadratic;
  law.share = random.Uniform(-0.3, 0.5);
  if (random.Uniform() < 0.4) {
    cell.press.onset = random.Uniform() < 0.5 ? sim::Onset::kFlat : sim::Onset::kCurved;
    cell.press.onset_travel_mm = random.Uniform(0.0005, 0.005);
  }
  sim::DisturbanceTraits& d = cell.disturbance;
  d.noise_g = LogUniform(random, 0.1, setting == Setting::kPoor ? 3 : 6);
  d.approach_noise_g = random.Uniform(0, 2) * d.noise_g;
  d.drift_g_s = random.Normal(0, 4);
  if (random.Uniform() < 0.4) {
    d.hum_hz = random.Uniform() < 0.5 ? 50 : 60;
    d.hum_g = LogUniform(random, 0.2, 3);
    d.hum_second = random.Uniform(0, 0.5);
  }
  cell.converter.rate_hz = LogUniform(random, 80, 4000);
  cell.converter.filter_order = static_cast<int>(random.Below(5));
  sim::TapMotion& motion = row.scene.motion;
  const bool poor = setting == Setting::kPoor;
  motion.approach_speed_mm_s = poor ? LogUniform(random, 0.5, 2) : LogUniform(random, 1, 5);
  motion.trigger_force_g = poor ? random.Uniform(15, 50) : random.Uniform(50, 120);
  row.scene.press_mm = 0;  // as the trigger and its latency bring it
  const double about_mm =
      motion.trigger_force_g / law.stiffness_g_mm +
      motion.approach_speed_mm_s * (motion.stop_latency_s + 2 / cell.converter.rate_hz);
  motion.pull_back_mm = about_mm * (poor ? random.Uniform(1.2, 1.8) : random.Uniform(1.8, 5)) +
                        cell.press.onset_travel_mm;
  motion.pull_back_speed_mm_s = poor ? LogUniform(random, 0.3, 2) : LogUniform(random, 0.1, 1);
  return row;
}

struct Followed {
  TapAnswers answers;
  [[nodiscard]] double Good() const { return 1 - answers.RefusedShare(); }
  [[nodiscard]] double HalfWidth() const {
    return answers.half_width_um.empty() ? std::nan("") : Median(answers.half_width_um);
  }
};

Followed Follow(const TapRow& row, std::uint64_t first_seed) {
  constexpr tap::Method kContact[] = {tap::Method::kContact};
  return {StudyRow(row, kFollowed, first_seed, kContact).of[0]};
}

struct RecordedTap {
  sim::SimulatedTap simulated;
  std::vector<tap::Move> moves;
  tap::TapAnalysis analysis;
  [[nodiscard]] tap::TapView View() const { return {simulated.time_s, simulated.force_g, moves}; }
};

std::vector<RecordedTap> Record(TapRow row, std::uint64_t first_seed, tap::TapOptions& options) {
  std::vector<RecordedTap> recorded;
  for (int i = 0; i < kRecorded; ++i) {
    RecordedTap tap;
    tap.simulated = SimulateRow(row, first_seed + static_cast<std::uint64_t>(i));
    tap.moves = MovesOf(tap.simulated);
    options.latency_s = tap.simulated.latency_s;
    tap.analysis = tap::TapAnalyser(options).Analyse(tap.View());
    recorded.push_back(std::move(tap));
  }
  return recorded;
}

// Sets what the advice changes. A press force is asked of the trigger, by its difference.
void FollowAdvice(const tap::Tuning& tuning, sim::TapMotion& motion) {
  for (const tap::Advice& advice : tuning.advice) {
    if (!advice.change || !std::isfinite(advice.advised)) continue;
    if (advice.what == "pull-back distance") motion.pull_back_mm = advice.advised;
    if (advice.what == "pull-back speed") motion.pull_back_speed_mm_s = advice.advised;
    if (advice.what == "press force") motion.trigger_force_g += advice.advised - advice.present;
  }
}

// Sums over the cells.
struct Outcome {
  int advised = 0;
  int kept_bad = 0;  // cells left alone though less than 95 % of their taps are good
  int wider = 0;
  int followed = 0;  // taps of the cells that are advised to change
  int good = 0;
  int covered = 0;
};

bool Differ(const sim::TapMotion& a, const sim::TapMotion& b) {
  return a.pull_back_mm != b.pull_back_mm || a.pull_back_speed_mm_s != b.pull_back_speed_mm_s ||
         a.trigger_force_g != b.trigger_force_g;
}

tap::Tuning Tune(const std::vector<RecordedTap>& recorded, const tap::TapOptions& options) {
  std::vector<tap::TuningTap> taps;
  // Each at its own place of a bed that is not level.
  for (const RecordedTap& tap : recorded) {
    taps.push_back({.tap = tap.View(),
                    .analysis = &tap.analysis,
                    .x_mm = 10.0 * static_cast<double>(taps.size()),
                    .y_mm = 0});
  }
  return tap::Tune(taps, {.analysis = options});
}

void StudyCell(std::uint64_t seed, Setting setting, Outcome& outcome) {
  TapRow row = DrawCell(seed, setting);
  tap::TapOptions options;
  const tap::Tuning tuning = Tune(Record(row, 1000 * seed, options), options);
  const sim::TapMotion before = row.scene.motion;
  const Followed present = Follow(row, 1000 * seed + 100);
  fmt::print("| {} | {:.0f} | {:.2f} | {:.0f} | {:.3f}, {:.2f} | {:.0f} | {:.0f} % | {:.2f} | ",
             row.name, row.cell.press.law.stiffness_g_mm, row.cell.disturbance.noise_g,
             row.cell.converter.rate_hz, before.pull_back_mm, before.pull_back_speed_mm_s,
             before.trigger_force_g, 100 * present.Good(), present.HalfWidth());
  FollowAdvice(tuning, row.scene.motion);
  const sim::TapMotion& after = row.scene.motion;
  if (tuning.end == tap::TuningEnd::kNone || !Differ(before, after)) {
    outcome.kept_bad += present.Good() < kLeastGood;
    fmt::print("{} | | | | {:.0f} % | {} | {} |\n", tap::ToString(tuning.end),
               100 * present.answers.Coverage(), present.answers.Reasons(2),
               present.Good() < kLeastGood ? tuning.because : "");
    return;
  }
  ++outcome.advised;
  outcome.followed += kFollowed;
  if (const Result<void> possible = sim::Validate(after); !possible) {
    fmt::print("{} | | | | | | impossible |\n", possible.error().message);
    return;
  }
  const Followed under = Follow(row, 1000 * seed + 100);
  outcome.good += static_cast<int>(under.answers.error_um.size());
  outcome.covered += under.answers.covered;
  const bool wider = under.HalfWidth() > kWorseAtMost * present.HalfWidth();
  outcome.wider += wider;
  fmt::print("{:.3f}, {:.2f} | {:.0f} | {:.0f} % | {:.2f} | {:.0f} % | {} |{}{} |\n",
             after.pull_back_mm, after.pull_back_speed_mm_s, after.trigger_force_g,
             100 * under.Good(), under.HalfWidth(), 100 * under.answers.Coverage(),
             under.answers.Reasons(2), under.Good() < kLeastGood ? " bad" : "",
             wider ? " wider" : "");
}

void StudyCells(const char* what, Setting setting) {
  const int cells = std::max(1, static_cast<int>(FromEnvironment("TRAMMEL_CELLS", 50)));
  const std::uint64_t seed = FromEnvironment("TRAMMEL_TAPS_SEED", kReportedTapSeed);
  fmt::print(
      "\n{}: {} cells, seeds from {}: {} taps recorded, {} taps as they are and {} under the "
      "advice.\n\n| cell | gf/mm | noise gf | samples/s | pull-back mm, mm/s | trigger gf | good | "
      "half-width um | advised mm, mm/s | trigger gf | good | half-width um | covered | refused "
      "because | |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      what, cells, seed, kRecorded, kFollowed, kFollowed);
  Outcome outcome;
  for (int c = 0; c < cells; ++c) {
    StudyCell(seed + static_cast<std::uint64_t>(c), setting, outcome);
    std::fflush(stdout);
  }
  fmt::print(
      "\n{} of {} cells are advised to change: under the advice {:.1f} % of {} taps are good, "
      "{:.1f} % of the good ones covered, {} cells have wider intervals. {} of the other cells "
      "have "
      "less than 95 % of good taps.\n",
      outcome.advised, cells, 100.0 * outcome.good / std::max(1, outcome.followed),
      outcome.followed, 100.0 * outcome.covered / std::max(1, outcome.good), outcome.wider,
      outcome.kept_bad);
  EXPECT_GE(outcome.good, kLeastGood * outcome.followed);
  EXPECT_LE(outcome.wider, kMostWider * outcome.advised);
}

TEST(TapTuneStudy, TapsUnderTheAdviceAreGoodAndNoLessCertain) {
  StudyCells("Middling settings", Setting::kMiddling);
  StudyCells("Poor settings", Setting::kPoor);
}

}  // namespace
}  // namespace trammel
