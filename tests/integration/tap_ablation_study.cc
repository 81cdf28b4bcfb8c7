// What each decision of the published method buys: taps of the kinds that its write-up names, each
// taken apart with the three root causes switched back on one by one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "support/drawn_tap.h"
#include "tap/analyse/analyse.h"

namespace trammel::tap {
namespace {

using test_support::DrawnTap;
using test_support::TapDrawing;

constexpr int kTaps = 1000;
constexpr std::uint64_t kFirstSeed = 40000;  // of no test

struct Kind {
  std::string name;
  TapDrawing drawing;
};

// Klipper's usual 350 mm/s^2 are over within a third of a sample; a pull-back that takes ten
// samples to reach its speed shows what those do.
std::vector<Kind> Kinds() {
  std::vector<Kind> kinds;
  kinds.push_back({"clean", {}});
  TapDrawing slow_start;
  slow_start.acceleration_mm_s2 = 10;
  kinds.push_back({"slow start", slow_start});
  TapDrawing flat = slow_start;
  flat.onset_lag_s = 0.025;
  kinds.push_back({"onset flat", flat});
  TapDrawing swinging = slow_start;
  swinging.onset_ring_g = 100;
  kinds.push_back({"onset swings", swinging});
  TapDrawing stiffening;
  stiffening.curvature = 0.5;
  kinds.push_back({"stiffening", stiffening});
  TapDrawing softening;
  softening.curvature = -0.3;
  kinds.push_back({"softening", softening});
  TapDrawing noisy;
  noisy.approach_noise_g = 12;
  kinds.push_back({"noisy approach", noisy});
  TapDrawing all = swinging;
  all.onset_lag_s = 0.025;
  all.curvature = -0.3;
  all.approach_noise_g = 12;
  kinds.push_back({"all of these", all});
  return kinds;
}

struct Ablation {
  std::string name;
  TwoLineOptions options;
};

const Ablation kAblations[] = {
    {"as published", {false, true, false}}, {"+ acceleration", {true, true, false}},
    {"- split", {false, false, false}},     {"+ acceleration - split", {true, false, false}},
    {"+ Kneedle", {false, true, true}},
};

struct Outcome {
  int answered = 0;
  double mean_um = 0;
  double deviation_um = 0;
  double worst_um = 0;
};

Outcome Repeat(const TapDrawing& drawing, const TwoLineOptions& two_line) {
  TapOptions options;
  options.method = Method::kTwoLine;
  options.two_line = two_line;
  TapAnalyser analyser(options);
  std::vector<double> errors_um;
  Outcome outcome;
  for (int i = 0; i < kTaps; ++i) {
    const DrawnTap drawn = DrawTap(drawing, kFirstSeed + static_cast<std::uint64_t>(i));
    std::vector<Move> moves;
    for (const auto& move : drawn.moves) {
      moves.push_back({move.start_time_s, move.duration_s, move.start_velocity_mm_s,
                       move.acceleration_mm_s2, move.start_z_mm, move.z_direction});
    }
    const TapAnalysis result = analyser.Analyse({drawn.time_s, drawn.force_g, moves});
    if (result.verdict == Verdict::kGood) {
      errors_um.push_back((result.contact_z_mm - drawn.contact_z_mm) * 1e3);
      outcome.worst_um = std::max(outcome.worst_um, std::abs(errors_um.back()));
    }
  }
  outcome.answered = static_cast<int>(errors_um.size());
  if (outcome.answered > 1) {
    outcome.mean_um = Mean(errors_um);
    outcome.deviation_um = StandardDeviation(errors_um);
  }
  return outcome;
}

double RootMeanSquare(const Outcome& outcome) {
  return std::hypot(outcome.mean_um, outcome.deviation_um);
}

TEST(TapAblationStudy, PrintsWhatEachDecisionBuys) {
  fmt::print("error of the contact's height, mean +- deviation (worst) in um; refused of {}\n",
             kTaps);
  fmt::print("| taps |");
  for (const Ablation& ablation : kAblations) {
    fmt::print(" {} |", ablation.name);
  }
  fmt::print("\n|---|{}\n", std::string("---|---|---|---|---|"));
  for (const Kind& kind : Kinds()) {
    fmt::print("| {} |", kind.name);
    std::vector<Outcome> row;
    for (const Ablation& ablation : kAblations) {
      row.push_back(Repeat(kind.drawing, ablation.options));
      const Outcome& outcome = row.back();
      fmt::print(" {:+.2f} ± {:.2f} ({:.1f}); {} |", outcome.mean_um, outcome.deviation_um,
                 outcome.worst_um, kTaps - outcome.answered);
    }
    fmt::print("\n");
    EXPECT_GE(row[0].answered, kTaps * 98 / 100) << kind.name;
    if (kind.name == "stiffening" || kind.name == "softening") {
      EXPECT_LT(2 * RootMeanSquare(row[0]), RootMeanSquare(row[2])) << kind.name;
    }
  }
}

}  // namespace
}  // namespace trammel::tap
