#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct TapInput {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<Move> moves;
  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

// Approach from 1 mm at 2 mm/s to -45 um, dwell, pull-back at 0.32 mm/s; 3500 gf/mm below 0.
TapInput TapRecording() {
  TapInput tap;
  tap.moves = {{0, 0.5225, 2, 0, 1, -1},
               {0.5225, 0, 0, 0, -0.045, 0},
               {0.9, 0.001, 0, 320, -0.045, 1},
               {0.901, 0.3, 0.32, 0, -0.04484, 1},
               {1.201, 0.001, 0.32, -320, 0.05116, 1}};
  for (int i = 0; i < 416; ++i) {
    const double time_s = 0.1 + i / 320.0;
    const double z = time_s < 0.5225  ? 1 - 2 * time_s
                     : time_s < 0.901 ? -0.045
                     : time_s < 1.201 ? -0.04484 + 0.32 * (time_s - 0.901)
                                      : 0.0513;
    tap.time_s.push_back(time_s);
    tap.force_g.push_back(100 + 3500 * std::max(0.0, -z));
  }
  return tap;
}

FindingCode ReasonFor(const TapInput& tap) {
  TapAnalyser analyser({});
  const TapAnalysis analysis = analyser.Analyse(tap.View());
  EXPECT_FALSE(Explain(analysis.reason).empty());
  if (analysis.verdict != Verdict::kGood) {
    EXPECT_TRUE(std::isnan(analysis.contact_mm.value));
    EXPECT_TRUE(std::isnan(analysis.contact_mm.interval95.lo));
  }
  return analysis.reason.code;
}

TEST(TapInput, ACleanTapHasItsContact) {
  const TapInput tap = TapRecording();
  TapAnalyser analyser({});
  const TapAnalysis analysis = analyser.Analyse(tap.View());
  ASSERT_EQ(analysis.verdict, Verdict::kGood);
  EXPECT_NEAR(analysis.contact_mm.value, 0, 1e-5);
}

TEST(TapInput, WhatIsNoTapIsRefusedByItsName) {
  const struct {
    FindingCode code;
    void (*change)(TapInput&);
  } rows[] = {{FindingCode::kNoSamples, [](TapInput& tap) { tap = {}; }},
              {FindingCode::kNoSamples, [](TapInput& tap) { tap.time_s = tap.force_g = {0.1}; }},
              {FindingCode::kNoSamples, [](TapInput& tap) { tap.force_g.resize(10); }},
              {FindingCode::kUnsortedTimes,
               [](TapInput& tap) { std::swap(tap.time_s[200], tap.time_s[201]); }},
              {FindingCode::kMissingMoves, [](TapInput& tap) { tap.moves.clear(); }},
              {FindingCode::kMissingMoves, [](TapInput& tap) { tap.moves.resize(2); }},
              {FindingCode::kMovesOutside,
               [](TapInput& tap) {
                 for (Move& move : tap.moves) move.start_time_s += 1000;
               }},
              {FindingCode::kTooManySamples,
               [](TapInput& tap) {
                 tap.time_s.assign(10'000'000, 0);
                 tap.force_g.assign(10'000'000, 0);
               }},
              // An approach that was queued farther ends at the halt.
              {FindingCode::kNone, [](TapInput& tap) { tap.moves[0].duration_s = 40; }}};
  for (const auto& row : rows) {
    TapInput tap = TapRecording();
    row.change(tap);
    EXPECT_EQ(Name(ReasonFor(tap)), Name(row.code));
  }
  TapInput tap = TapRecording();
  std::fill(tap.time_s.begin(), tap.time_s.end(), tap.time_s[250]);
  EXPECT_NE(ReasonFor(tap), FindingCode::kNone);
}

TEST(TapInput, NumbersThatAreNoneAreRefused) {
  for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e300}) {
    TapInput tap = TapRecording();
    tap.force_g[300] = bad;
    EXPECT_EQ(ReasonFor(tap), FindingCode::kNotFinite);
    tap = TapRecording();
    tap.time_s[300] = bad;
    EXPECT_EQ(ReasonFor(tap), FindingCode::kNotFinite);
  }
}

TEST(TapInput, MovesOfNoPrinterAreRefused) {
  for (const double bad : {kNan, 1e300, -1e300, std::numeric_limits<double>::infinity()}) {
    for (double Move::*field : {&Move::start_time_s, &Move::duration_s, &Move::start_velocity_mm_s,
                                &Move::acceleration_mm_s2, &Move::start_z_mm, &Move::z_direction}) {
      TapInput tap = TapRecording();
      tap.moves[3].*field = bad;
      EXPECT_EQ(ReasonFor(tap), FindingCode::kAbsurdMoves);
    }
  }
}

}  // namespace
}  // namespace trammel::tap
